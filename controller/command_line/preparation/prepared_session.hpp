// Prepares a session for `run`, `sim` and `plan` without opening a bus: loads and checks all files, fills in all
// defaults.
#pragma once

#include <string>

#include "controller/command_line/preparation/run_options.hpp"
#include "controller/stability/pose_loop.hpp"
#include "controller/stability/stability.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::command_line {

struct PreparedSession {
  description::Cell cell;
  description::SensorDescription sensor;
  description::HandDescription hand;
  scenes::Scene scene;
  std::shared_ptr<const scenes::Clearances> clearances;  // of the scene
  std::shared_ptr<const models::PoseAlgorithm> rigid;    // scene and tool, for clearances; null: the tool is a point
  controller::SessionSettings settings;
  double duration_s = 10.0;
  bool damps_gears = true;     // damps gears with measured torque, as strongly as is stable
  LookaheadChoice lookahead;   // the requested lookahead; settings.horizon_s is the result
  controller::LoopModel loop;  // the controller's model of the closed loop, in the start pose

  [[nodiscard]] bool impedance() const noexcept { return settings.scheme == controller::Scheme::impedance; }
};

// The hand for the stability check, with the grip that needs the most mass in this loop. That isn't always the stiffest
// grip: one that is nearly as stiff but has little damping needs more. If no mass is stable with some grip, returns
// that grip.
controller::HandModel hand_model(const PreparedSession& session, controller::LoopModel loop);
// The same in the session's own loop.
controller::HandModel hand_model(const PreparedSession& session);

// The hand and the loop of the tool's rotation, in Nm/rad, Nms/rad and kg m².
controller::HandModel turning_hand_model(const PreparedSession& session);
controller::LoopModel turning_loop(const PreparedSession& session);
// The loop of translation and rotation for pose_loop_at(), free and with the tool's extreme points in contact. Absent:
// the hand doesn't turn the tool.
std::optional<controller::PoseLoopModel> turned_model(const PreparedSession& session);
// The slowest decaying oscillation of that loop in the start pose. Absent: the tool isn't turned, or the loop isn't
// stable.
std::optional<controller::Swing> slowest_swing(const PreparedSession& session);
// The inertia that the hand feels, the load behind the sensor included. Precondition: the orientation is free.
double felt_inertia_kg_m2(const PreparedSession& session);

// The poses that the hand means to lead the arm to, the start first. Objects of the scene are ignored.
std::vector<models::JointVector> led_poses(const PreparedSession& session);
// The loop in all these poses.
controller::LoopModel led_loop(const PreparedSession& session);

// The longest stable lookahead horizon, with margins, for the session's mass and loop.
double longest_horizon_s(const PreparedSession& session);

// Sets the lookahead horizon. Call it after each change of the session's mass or loop.
void choose_horizon(PreparedSession& session);

// Throws SetupError. Opens no bus and starts nothing.
PreparedSession prepare(const RunOptions& options);

// Returns the session with another timestep. Throws SetupError if no drive could hold it.
PreparedSession with_timestep(PreparedSession session, const RunOptions& options, double period_s);

// Returns the session with another mass (kg) and centre of mass (m, in S) of the tool behind the sensor. If a tool with
// a shape turns, its felt inertia stays the same.
PreparedSession with_tool(PreparedSession session, double mass_kg, const std::array<double, 3>& centre_S_m);

// Returns the session with drives that measure the torque of each elastic gear as `torque` says.
PreparedSession with_gear_torques(PreparedSession session, const description::GearTorque& torque);

// Returns a problem with the origin of the timestep filled in: `--timestep`, or the cell's file and line. Without a
// line, the file doesn't set the timestep.
description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options);

// Throws SetupError if the handle alone is heavier than the mass, or if the loop with the hand would be unstable
// (unless forced, in simulation only). Impedance type: checks the virtual coupling.
void require_stable(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if a turning tool's inertia isn't above the handle's own, or is too large to be turned.
void require_inertia_in_range(const PreparedSession& session);

// The delay from the proxy's step to the links: the setpoint is latched at the next SYNC and reached a period later,
// and the setpoint filter adds its delay. Impedance type: 0, as the proxy stays where the tool may be.
double motion_delay_s(const PreparedSession& session);

// The delay from a force on the handle to the arm having followed the proxy (s).
double total_delay_s(const PreparedSession& session);

}  // namespace proxarm::command_line
