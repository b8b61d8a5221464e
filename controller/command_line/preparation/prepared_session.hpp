// Prepares a session for `run`, `sim` and `plan`: loads and checks all files, and fills in all defaults. Opens no bus.
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
  std::shared_ptr<const scenes::Clearances> clearances;  // of the scene's objects
  std::shared_ptr<const models::PoseAlgorithm> rigid;    // the scene with its rigid tool; null: the tool is a point
  controller::SessionSettings settings;
  double duration_s = 10.0;
  bool damps_gears = true;     // whether gears with a measured torque are damped
  LookaheadChoice lookahead;   // the requested lookahead; settings.horizon_s is the result
  controller::LoopModel loop;  // the controller's model of the closed loop, in the start pose

  [[nodiscard]] bool impedance() const noexcept { return settings.scheme == controller::Scheme::impedance; }
};

// Returns the hand for the stability check, with that one of the hand's grips which needs the largest mass in this
// loop. That isn't always the stiffest grip: a grip that is nearly as stiff but has little damping may need more mass.
// If no mass is stable with some grip, returns the hand with that grip.
controller::HandModel hand_model(const PreparedSession& session, controller::LoopModel loop);
// Returns the hand for the stability check in the session's own loop.
controller::HandModel hand_model(const PreparedSession& session);

// Return the hand and the loop for the tool's rotation alone. Their stiffness is in Nm/rad, their damping in Nms/rad,
// and their mass is an inertia in kg m².
controller::HandModel turning_hand_model(const PreparedSession& session);
controller::LoopModel turning_loop(const PreparedSession& session);
// Returns the model of the loop of translation and rotation for pose_loop_at(): in free motion, and with one of the
// tool's extreme points in contact. Returns nullopt if the hand doesn't turn the tool.
std::optional<controller::PoseLoopModel> turned_model(const PreparedSession& session);
// Returns the oscillation that decays most slowly in the loop of turned_model() in the start pose. Returns nullopt if
// the hand doesn't turn the tool, or if the loop isn't stable.
std::optional<controller::Swing> slowest_swing(const PreparedSession& session);
// Returns the inertia that the hand feels, including that of the load behind the sensor. Precondition: the orientation
// is free.
double felt_inertia_kg_m2(const PreparedSession& session);

// Returns the poses of the arm along the hand's intended motion, the start pose first. Objects of the scene are
// ignored.
std::vector<models::JointVector> led_poses(const PreparedSession& session);
// Returns the session's loop in all poses of led_poses().
controller::LoopModel led_loop(const PreparedSession& session);

// Returns the longest lookahead horizon that is stable with margins, for the session's mass and loop.
double longest_horizon_s(const PreparedSession& session);

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

// Returns a problem that names what set the timestep: `--timestep`, or the key in the cell's file with its line. If the
// cell's file doesn't set the timestep, the problem has no line.
description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options);

// Throws SetupError if the handle alone is heavier than the requested mass, or if the loop with the hand would be
// unstable. In simulation, --force-unstable allows an unstable loop. For the impedance type, checks the stability of
// the virtual coupling instead.
void require_stable(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if the tool may turn and its felt inertia isn't above the handle's own inertia, or is too large for
// a hand to turn.
void require_inertia_in_range(const PreparedSession& session);

// Returns the delay from the proxy's step to the motion of the links: the setpoint is latched at the next SYNC and
// reached one period later, and the setpoint filter adds its delay. Returns 0 for the impedance type, in which no
// setpoint of a position is sent.
double motion_delay_s(const PreparedSession& session);

// Returns the delay from a force on the handle to the arm's motion, in s.
double total_delay_s(const PreparedSession& session);

}  // namespace proxarm::command_line
