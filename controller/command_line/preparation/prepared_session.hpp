// What `run`, `sim` and `plan` know before they open a bus: all files loaded and checked, all defaults filled in.
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
  std::shared_ptr<const models::PoseAlgorithm>
      rigid;  // scene and tool, for questions of room; null: the tool is a point
  controller::SessionSettings settings;
  double duration_s = 10.0;
  bool damps_gears = true;     // whose torque is measured, as hard as holds
  LookaheadChoice lookahead;   // what was asked for; settings.horizon_s is what came of it
  controller::LoopModel loop;  // how the controller expects the closed loop to behave, in the start pose

  [[nodiscard]] bool impedance() const noexcept { return settings.scheme == controller::Scheme::impedance; }
};

// The hand as the stability check takes it: at the one of its grips that asks for most mass in this loop, which needn't
// be the stiffest: one that is nearly as stiff and damps little asks for more. Where no mass is stable with one, that.
controller::HandModel hand_model(const PreparedSession& session, controller::LoopModel loop);
// In the session's own.
controller::HandModel hand_model(const PreparedSession& session);

// The same of the tool's rotation, in Nm/rad, Nms/rad and kg m².
controller::HandModel turning_hand_model(const PreparedSession& session);
controller::LoopModel turning_loop(const PreparedSession& session);
// Both at once, as pose_loop_at() takes it, free and where the tool touches with its ends. Absent: the hand doesn't
// turn the tool.
std::optional<controller::PoseLoopModel> turned_model(const PreparedSession& session);
// The swing of that loop in the start pose that takes longest to die away. Absent: the tool isn't turned, or it isn't
// stable.
std::optional<controller::Swing> slowest_swing(const PreparedSession& session);
// What the hand feels, the tool behind the sensor included. Precondition: the orientation is free.
double felt_inertia_kg_m2(const PreparedSession& session);

// The poses that the hand means to lead the arm to, beginning with the start, whatever the scene has in its way.
std::vector<models::JointVector> led_poses(const PreparedSession& session);
// The loop in all of them.
controller::LoopModel led_loop(const PreparedSession& session);

// The longest horizon of a lookahead that is stable with margins for the session's mass and loop.
double longest_horizon_s(const PreparedSession& session);

// The lookahead's horizon for the session's mass and loop. To be called when one of them has changed.
void choose_horizon(PreparedSession& session);

// Throws SetupError. Opens no bus and starts nothing.
PreparedSession prepare(const RunOptions& options);

// The same session with another timestep. Throws SetupError where no drive could hold that one.
PreparedSession with_timestep(PreparedSession session, const RunOptions& options, double period_s);

// The same session with another mass (kg) and centre of mass (m, in S) of the tool behind the sensor. The inertia of a
// tool with a shape that turns stays as it is felt.
PreparedSession with_tool(PreparedSession session, double mass_kg, const std::array<double, 3>& centre_S_m);

// The same session with drives that measure the torque of each gear that has a stiffness, so.
PreparedSession with_gear_torques(PreparedSession session, const description::GearTorque& torque);

// Where the timestep comes from, as a problem begins that is to be told of it: `--timestep`, or the cell's file and
// line. Without a line, the file says nothing of it and has the default.
description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options);

// The mass and timestep, judged: throws SetupError where the handle alone is heavier, or where the loop with the hand
// would be unstable (unless forced, which only a simulation may be). Impedance type: the virtual coupling is judged.
void require_stable(const PreparedSession& session, const RunOptions& options);

// The inertia of a tool that turns: throws SetupError at or below the handle's own, and for one that nothing turns.
void require_inertia_in_range(const PreparedSession& session);

// From the proxy's step to the links being where it went: latched at the next SYNC, reached a period later, and what
// the filter of the setpoints takes. Impedance type: 0, the proxy is where the tool may be.
double motion_delay_s(const PreparedSession& session);

// Total delay from a force on the handle to the arm being where the proxy went, in seconds.
double total_delay_s(const PreparedSession& session);

}  // namespace proxarm::command_line
