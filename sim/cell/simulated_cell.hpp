// A complete simulated cell: arm, hand and physics, a drive for each joint, and the force sensor, on the cell's buses.
//
//   SimulatedCell far_end(cell, sensor, hand, network.events());
//   far_end.attach_to(network);   // in-process; or connect() each node to a port of a real interface
//   far_end.power_on();
// After power_on(), only events and frames drive the cell. It doesn't know the controller.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fieldbus/modbus/modbus_client.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "sim/bus/device_node.hpp"
#include "sim/devices/ati_device.hpp"
#include "sim/devices/datagram_sensor_device.hpp"
#include "sim/devices/described_device.hpp"
#include "sim/devices/device_fault.hpp"
#include "sim/devices/drive_device.hpp"
#include "sim/devices/enabling_switch.hpp"
#include "sim/devices/modbus_device.hpp"
#include "sim/devices/modbus_sensor_device.hpp"
#include "sim/physics/plant.hpp"
#include "sim/physics/proof_helper.hpp"

namespace proxarm::sim {

class PlantAxis;

struct SimulatedCellConfig {
  PlantConfig plant;
  std::vector<DeviceFault> faults;
  // Times at which the enabling input is pressed; if empty, it is pressed from 0.1 s on.
  std::vector<PressedSpan> enabling;
  bool helps_to_prove = false;       // true: a simulated person pushes when a proof asks for it (proof_helper.hpp)
  std::int64_t tick_ns = 1'000'000;  // interval of the devices' on_time(); the step of the physics is shorter
  std::int64_t drive_boot_time_ns = 20'000'000;
  std::int64_t brake_release_ns = 30'000'000;
};

// True values of the simulation, in W. The controller never sees them.
struct Truth {
  std::int64_t time_ns = 0;
  models::Pose X_WT = models::Pose::Identity();        // pose of the handle's rendered point T
  models::Vec3 velocity_W = models::Vec3::Zero();      // m/s
  models::Vec3 acceleration_W = models::Vec3::Zero();  // m/s²
  models::Vec3 hand_force_W = models::Vec3::Zero();    // N, force of the hand on the handle at T
  models::Vec3 hand_torque_W = models::Vec3::Zero();   // Nm, torque of the hand on the handle about T
  models::Wrench sensor_wrench_S;                      // load on the sensor, including weight and inertia of the handle
  bool hand_started = false;                           // true once all drives have been enabled
  std::int64_t hand_start_ns = 0;
};

std::vector<fieldbus::SimulatedBusConfig> simulated_buses(const description::Cell& cell);

class SimulatedCell final : private Clockwork {
 public:
  // Throws SetupError as Plant does, and if a bus is missing or if a fault names a missing device.
  SimulatedCell(const description::Cell& cell, const description::SensorDescription& sensor,
                const description::HandDescription& hand, fieldbus::EventQueue& events,
                const SimulatedCellConfig& config = {});
  SimulatedCell(const SimulatedCell&) = delete;
  SimulatedCell& operator=(const SimulatedCell&) = delete;
  ~SimulatedCell() override;

  // The nodes are: one per drive on CAN, in the cell's order; then the enabling switch if it sends a message; then the
  // sensor if it is on CAN. The nodes must be connected to their buses before power_on().
  [[nodiscard]] std::size_t node_count() const noexcept { return nodes_.size(); }
  [[nodiscard]] DeviceNode& node(std::size_t index) noexcept { return *nodes_[index]; }

  // Return the devices on a Modbus line: either for a server on a real line, or as an in-process master whose requests
  // are answered at once. The cell must outlive the results.
  [[nodiscard]] std::vector<ModbusUnit*> modbus_devices(const std::string& line);
  [[nodiscard]] std::unique_ptr<fieldbus::ModbusClient> modbus_client(const std::string& line);

  // The sensor on UDP: either on a wire of a real network, which must outlive the cell, or with a port in this process.
  // Precondition of connect_sensor(): the cell's sensor is on UDP. Without one, nothing comes from the port.
  void connect_sensor(DatagramWire& wire) noexcept { sensor_datagrams_->connect(wire); }
  [[nodiscard]] std::unique_ptr<fieldbus::DatagramPort> datagram_port();

  // Connects each node to the network's bus with the same name.
  void attach_to(fieldbus::SimulatedCanNetwork& network);

  // Starts all devices, the physics and the devices' clocks at the event queue's current time.
  void power_on();

  // Takes the power from all drives at once and for good, as the main switch does: no torque, no frames, brakes close.
  void cut_power() noexcept;

  // Returns the true values at the event queue's current time, or up to one step of the physics before it.
  [[nodiscard]] Truth truth() noexcept;
  // Sets a function that is called after each step of the physics, in the order of time; an empty function removes it.
  // If a run must not allocate, the function must not allocate either.
  void set_observer(std::function<void(const Truth&)> observer) { observer_ = std::move(observer); }

  [[nodiscard]] Plant& plant() noexcept { return plant_; }
  // Precondition: the drive is on CAN.
  [[nodiscard]] DriveDevice& drive(std::size_t axis) noexcept { return *drives_[axis]; }
  // Precondition: the drive is on Modbus.
  [[nodiscard]] ModbusDevice& modbus_drive(std::size_t axis) noexcept { return *modbus_drives_[axis]; }
  [[nodiscard]] SensorFaults& sensor_faults() noexcept;
  [[nodiscard]] const description::Cell& cell() const noexcept { return cell_; }

 private:
  class PlantGauges;
  class WirelessModbus;
  class PlantWrench;

  void advance_to(std::int64_t time_ns) noexcept override;
  void seen(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void add_enabling(const std::vector<PressedSpan>& spans);
  void press(std::int64_t time_ns) noexcept;
  [[nodiscard]] Truth present_truth() const noexcept;
  void add_drive(std::size_t axis, const SimulatedCellConfig& config);
  void add_modbus_drive(std::size_t axis);
  void add_sensor(const description::SensorDescription& sensor);
  void convert(std::int64_t time_ns) noexcept;
  void check_faults(const description::SensorDescription& sensor) const;
  void schedule_faults();
  void set_fault(std::size_t index, bool on, std::int64_t time_ns) noexcept;
  void set_drive_fault(std::size_t axis, const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept;
  void set_modbus_fault(std::size_t axis, const DeviceFault& fault, bool on) noexcept;
  void set_sensor_fault(const DeviceFault& fault, bool on) noexcept;
  void set_sensor_lie(const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept;
  void tick(std::int64_t time_ns) noexcept;
  [[nodiscard]] std::size_t bus_index(const std::string& name, const std::string& key) const;
  // Returns drives_.size() if there is no such joint.
  [[nodiscard]] std::size_t axis_of(const std::string& joint) const noexcept;

  description::Cell cell_;
  fieldbus::EventQueue& events_;
  std::int64_t tick_ns_;
  std::vector<DeviceFault> faults_;
  Plant plant_;
  std::vector<std::unique_ptr<DeviceNode>> nodes_;
  std::vector<std::unique_ptr<PlantAxis>> axes_;
  std::unique_ptr<PlantGauges> gauges_;
  std::vector<std::unique_ptr<DriveDevice>> drives_;          // one per axis; nullptr: the drive is on Modbus
  std::vector<std::unique_ptr<ModbusDevice>> modbus_drives_;  // one per axis; nullptr: the drive is on CAN
  std::vector<std::size_t> node_of_axis_;
  std::unique_ptr<PlantWrench> wrench_;
  std::unique_ptr<AtiDevice> sensor_;  // nullptr: described_sensor_ is used
  // Registers of described_sensor_ if it is on Modbus, else nullptr.
  std::unique_ptr<ModbusSensorDevice> sensor_registers_;
  // Wire of described_sensor_ if it is on UDP, else nullptr.
  std::unique_ptr<DatagramSensorDevice> sensor_datagrams_;
  std::unique_ptr<DescribedDevice> described_sensor_;
  std::unique_ptr<EnablingSwitch> enabling_;
  std::size_t enabling_axis_ = 0;  // the axis to whose drive the switch is wired
  std::optional<ProofHelper> helper_;
  std::function<void(const Truth&)> observer_;
};

}  // namespace proxarm::sim
