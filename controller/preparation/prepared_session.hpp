// Prepares a session for `run`, `sim` and `plan`: loads and checks all files, and fills in all defaults. Opens no bus.
#pragma once

#include <string>

#include "controller/preparation/run_options.hpp"
#include "controller/stability/stability.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

struct PreparedSession {
  description::Cell cell;
  description::SensorDescription sensor;
  description::HandDescription hand;
  scenes::Scene scene;
  std::shared_ptr<const scenes::Clearances> clearances;  // of the scene's objects
  std::shared_ptr<const models::PoseAlgorithm> rigid;    // the scene with its rigid tool; null: the tool is a point
  SessionSettings settings;
  double duration_s = 10.0;
  bool damps_gears = true;    // whether gears with a measured torque are damped
  LookaheadChoice lookahead;  // the requested lookahead; settings.horizon_s is the result
  LoopModel loop;             // the controller's model of the closed loop, in the start pose

  [[nodiscard]] bool impedance() const noexcept { return settings.scheme == Scheme::impedance; }
};

// Sets the lookahead horizon. Call this function after each change of the session's mass or loop.
void choose_horizon(PreparedSession& session);

// Prepares a session. Opens no bus and starts no thread or process. Throws SetupError.
PreparedSession prepare(const RunOptions& options);

// Returns the session with another timestep. Throws SetupError if that timestep isn't 0.05 to 100 ms, or is one that no
// drive can hold exactly.
PreparedSession with_timestep(PreparedSession session, const RunOptions& options, double period_s);

// Returns the session with another mass (kg) and centre of mass (m, in S) of the tool behind the sensor. If the tool
// has a shape and turns, the felt inertia stays the same.
PreparedSession with_tool(PreparedSession session, double mass_kg, const std::array<double, 3>& centre_S_m);

// Returns the session with drives that measure the torque of each elastic gear. `torque` describes how.
PreparedSession with_gear_torques(PreparedSession session, const description::GearTorque& torque);

}  // namespace proxarm::controller
