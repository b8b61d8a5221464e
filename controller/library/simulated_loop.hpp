// The closed loop in this process and in virtual time: the controller on one side, the simulated arm on the other, and
// parts of somebody's own in the place of either's. Nothing is printed and nothing drawn.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "controller/motion/motion_work.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/session/session.hpp"
#include "fieldbus/cia402/cyclic_drive.hpp"
#include "fieldbus/modbus/modbus_line.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/geometry/geometric_algorithm.hpp"
#include "scenes/compiler/compile.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "sim/devices/device_fault.hpp"
#include "sim/devices/enabling_switch.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm::controller {

// What own sensors and drives measure and move, and the wires that they may be on.
struct FarEnd {
  sim::SimulatedCell& cell;
  fieldbus::SimulatedCanNetwork& network;
};
using MakeSensor = std::function<std::unique_ptr<fieldbus::ForceSensor>(FarEnd&)>;
// The drive of the cell's joint with this number; the cell's description of it says range, gear and limits.
using MakeDrive = std::function<std::unique_ptr<fieldbus::CyclicDrive>(FarEnd&, std::size_t axis,
                                                                       const description::DriveDescription& drive)>;

// What isn't given is the cell's, the scene's and the hand's file's.
struct OwnParts {
  models::GeometricAlgorithm<3>* world = nullptr;  // in W; must outlive the loop
  sim::HandForce hand;
  // It is on the bus that the cell has for its sensor: frames from there come to it. The cell's own stays silent.
  MakeSensor sensor;
  std::map<std::string, MakeDrive> drives;  // by joint; frames of no bus come to them
};

// Throws SetupError for an arm whose tool can't move in space, for a tool with a shape, and for a lookahead: that steps
// a second proxy through a scene which it compiles anew, and somebody's own 𝒢 is there only once.
void require_own_world_fits(const PreparedSession& session);

// Sees each cycle's record, and the truth at its SYNC.
using LookAtCycle = std::function<void(const CycleRecord&, const sim::Truth&)>;

// What is simulated: the session's own cell, or that of --arm, which is wired as it is. Throws SetupError.
PreparedSession simulated_arm(const PreparedSession& session, const RunOptions& options);

// The far end, where it isn't just what the session takes it for.
struct SimulatedFarEnd {
  const PreparedSession* arm = nullptr;    // simulated_arm(); null: the session
  std::vector<sim::DeviceFault> faults;    // of its devices
  std::vector<sim::PressedSpan> enabling;  // of its enabling switch
};

class SimulatedLoop {
 public:
  // Throws SetupError. `session` must outlive the loop. Several loops may run at once, in different threads.
  explicit SimulatedLoop(const PreparedSession& session, const OwnParts& own = {}, const SimulatedFarEnd& far_end = {});
  SimulatedLoop(const SimulatedLoop&) = delete;
  SimulatedLoop& operator=(const SimulatedLoop&) = delete;

  // Powers the devices on and brings them up. Throws SetupError where the session can't begin.
  void start();
  // Once, after start(): until the session has lasted as long as it is to, a fault, or request_stop() of its cycle.
  // `before` is called before each cycle, at its time.
  SessionTally run(const LookAtCycle& look, const SessionLength& length,
                   const std::function<void(std::int64_t t_k_ns)>& before = {});

  [[nodiscard]] fieldbus::SimulatedCanNetwork& network() noexcept { return network_; }
  [[nodiscard]] Cycle& cycle() noexcept { return *cycle_; }  // after start()
  // What no arm can do, since its simulation has become unstable: when, in the time since power on. For
  // refuse_explosion().
  [[nodiscard]] std::optional<double> exploded_after_s() const noexcept { return exploded_after_s_; }
  [[nodiscard]] std::optional<std::int64_t> first_cycle_ns() const noexcept {
    return first_cycle_ns_;
  }  // since power on
  // By bus; 1 is all of its time from the first cycle to the last.
  [[nodiscard]] const std::map<std::string, double>& bus_load() const noexcept { return bus_load_; }

 private:
  void put_in(CycleParts& parts);
  void look_at_truth(std::int64_t t_k_ns);

  const PreparedSession& session_;
  OwnParts own_;
  fieldbus::SimulatedCanNetwork network_;
  sim::SimulatedCell far_end_;
  scenes::CompiledScene scene_;
  std::optional<Cycle> cycle_;
  sim::Truth truth_;  // at the present cycle's SYNC
  std::map<std::string, double> bus_load_;
  std::int64_t power_on_ns_ = 0;
  std::optional<double> exploded_after_s_;
  std::optional<std::int64_t> first_cycle_ns_;
};

// How a session of which nothing else matters came to its end.
struct QuietEnd {
  SessionEnd end = SessionEnd::fault;
  std::string fault;  // its name; empty: none
  MotionWork work;    // all zero where nothing is counted
};
QuietEnd run_quietly(const PreparedSession& session, const LookAtCycle& look);

// Fills in what only the simulation knows.
void add_truth(CycleRecord& record, const sim::Truth& truth);

// A Modbus line's worker on the virtual clock, from now on: an exchange takes as long as it does on the wire.
void pump(fieldbus::SimulatedCanNetwork& network, fieldbus::ModbusLine& line, std::int64_t time_ns);

// An arm that moves as none can: no fault of the session.
[[noreturn]] void refuse_explosion(double since_power_on_s);

}  // namespace proxarm::controller
