// Defines the objects on which every cycle works; session/bring_up.hpp builds and configures them before the first
// cycle.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "controller/motion/release.hpp"
#include "controller/motion/wrench_compensation.hpp"
#include "controller/rendering/pose_world.hpp"
#include "controller/rendering/rendered_tool.hpp"
#include "controller/rendering/torque_rendering.hpp"
#include "controller/setpoints/elastic_setpoint.hpp"
#include "controller/stability/link_motion.hpp"
#include "controller/supervision/enabling_input.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/modbus/modbus_line.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/inverse_kinematics.hpp"

namespace proxarm::controller {

struct DriveOnBus {
  static constexpr std::size_t no_bus = static_cast<std::size_t>(-1);

  std::unique_ptr<fieldbus::CyclicDrive> owned;
  fieldbus::CyclicDrive& drive;  // *owned
  std::size_t bus;               // index of the drive's bus in the network; no_bus: the drive is on a Modbus line
};

// The first drive that takes no setpoints after its time limit limit_s: enable_timeout_s of the cell's drive, or
// usual_s. drive = −1: there is no such drive. `following`: bits of the drives that take setpoints.
struct OverdueDrive {
  int drive = -1;
  double limit_s = 0.0;
};
[[nodiscard]] OverdueDrive first_overdue(const std::vector<DriveOnBus>& drives, std::uint8_t following, double waited_s,
                                         double usual_s) noexcept;

// A bus with drives, to which SYNC and the controller's heartbeat are sent.
struct DriveBus {
  std::size_t bus;
  fieldbus::SyncProducer sync;
  fieldbus::HeartbeatProducer heartbeat;
};

// Admittance type: everything between the hand's force and the setpoints.
struct AdmittanceParts {
  models::InverseKinematics inverse;
  ElasticSetpoint elastic;
  std::unique_ptr<RenderedTool> tool;
  std::optional<LinkMotion> links;  // used by the passivity observer if the tool turns
  std::unique_ptr<Release> release;
};

// All parts of a cycle. Drives are in the order of the arm's joints.
struct CycleParts {
  fieldbus::CanNetwork& network;
  std::vector<DriveOnBus> drives;
  std::vector<fieldbus::DriveSlot> can_drives;  // the drives on CAN; all drives if drives take torques
  std::vector<DriveBus> drive_buses;
  std::unique_ptr<fieldbus::ForceSensor> sensor;
  std::size_t sensor_bus;  // index of the sensor's bus; DriveOnBus::no_bus: the sensor is on a Modbus line or on UDP
  // Declared after drives and sensor, so that the lines' threads end before drives and sensor are destroyed.
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> modbus_lines;
  std::unique_ptr<models::Arm> arm;  // the arm is on the heap, because other objects keep references to it
  // The alternative decides the session's type: admittance or impedance.
  std::variant<AdmittanceParts, std::unique_ptr<TorqueRendering>> rendering;
  WrenchCompensation compensation;
  description::ToolDescription tool;  // the tool behind the sensor
  std::optional<EnablingInput> enabling;
  description::SupervisionDescription supervision;
};

// Returns the largest step of each joint in a cycle: the joint moves at the maximum speed of its drive.
std::array<double, models::max_axes> max_steps_rad(const std::vector<description::DriveDescription>& drives,
                                                   double period_s) noexcept;

}  // namespace proxarm::controller
