// What a cell's arm does to a person who is near it, measured on the simulated steel: how far it goes on when it is
// stopped at full speed, and how hard it presses on what is in its way.
//
// A trial is a session in virtual time: a hand leads the tool straight along a direction, at the speed that the cell
// allows, through free space. One goes undisturbed and tells when the tool is fastest; the others are the same up to
// then. There
//   the arm is stopped (category 0: power off, brakes close; 1: controlled, then off; 2: controlled, drives stay on),
//   or a body begins: a one-sided spring across the tool's way, in front of something that doesn't give way. It presses
//   on the handle, where the force sensor feels it, or on the arm in front of the sensor, which doesn't.
// Each in several poses and to both sides along the three axes of W, or along those that the tool can go in where its
// axes are fewer; what is told is the worst.
//
// A simulation of the values that the cell file has under `simulation:`. It certifies nothing.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "controller/assessment/thresholds.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::assessment {

enum class Stop : std::uint8_t { none, category_0, category_1, category_2 };

// In the tool's way.
struct Body {
  double stiffness_N_per_m = 0.0;  // 0: none
  models::Vec3 surface_W = models::Vec3::Zero(), normal_W = models::Vec3::UnitX();
  bool felt = true;
};

struct Trial {
  std::vector<double> start_rad;
  models::Vec3 direction_W = models::Vec3::UnitX();
  Stop stop = Stop::none;
  double at_s = 0.0;  // of the stop, or from when on the body is there; since power on
  Body body{};
};

struct Sample {
  double time_s = 0.0;  // since power on
  models::Vec3 tool_W = models::Vec3::Zero(), velocity_W = models::Vec3::Zero();
};

struct TrialResult {
  std::vector<Sample> samples;  // of each step of the physics
  double stopped_at_s = 0.0;    // when the order was given or the power went
  std::string end;              // why the session ended, where a fault ended it
};

// Runs a trial. Throws SetupError where the session can't begin.
using ArmTrial = std::function<TrialResult(const Trial&)>;

// The tool has stopped when it stays this near to where it ends, in m: less than skin gives way, and what elastic gears
// swing for some tenths of a second after a stop isn't counted as going on.
inline constexpr double stopped_within_m = 1e-3;
// It rests at the end of a trial if it is slower than this, in m/s: 0.1 mm of swinging at 16 Hz, an arm's first mode.
inline constexpr double rest_m_per_s = 0.01;

struct StopFigure {
  Stop stop = Stop::none;
  double from_m_per_s = 0.0, time_s = 0.0, distance_m = 0.0;
  bool at_rest = true;  // within the trial
  int pose = 0;
  std::string direction;  // "+x"
};

struct ClampFigure {
  bool felt = true;
  double stiffness_N_per_m = 0.0;
  double transient_N = 0.0, quasi_static_N = 0.0;  // largest force until half a second after the contact, and later
  double energy_J = 0.0;                           // largest k x²/2
  double left_N = 0.0;                             // what still presses at the trial's end
  double at_m_per_s = 0.0;                         // when the tool met it
  int pose = 0;                                    // of the largest transient force
  std::string direction{}, end{};
};

struct Assessment {
  std::vector<std::vector<double>> poses_rad;
  std::vector<StopFigure> stops;       // by category, the largest time and distance; of the distance's pose
  std::vector<double> longest_stop_s;  // beside each of them, of any pose
  std::vector<ClampFigure> clamps;     // by where it presses and stiffness
};

// The start pose and others about it, within ranges, workspace and keep-out zones, none much nearer to a singularity
// than the start. Fewer than asked for where there are none. The same for each call.
std::vector<std::vector<double>> poses_about_start(const description::Cell& cell, const models::Arm& arm, int count);

// Of a trial in which the arm was stopped.
StopFigure stop_figure(const TrialResult& result);
// Of a trial with a body.
ClampFigure clamp_figure(const Body& body, const TrialResult& result);

// Where a hand leads the tool.
struct Direction {
  std::string name;  // "+x"; "+1", "+2" where it isn't along an axis of W
  models::Vec3 along_W = models::Vec3::UnitX();
};
std::vector<Direction> directions_of(const models::ToolSpace& space);

Assessment assess(const std::vector<std::vector<double>>& poses_rad, const std::vector<Direction>& directions,
                  const Thresholds& thresholds, const ArmTrial& run_trial);

}  // namespace proxarm::assessment
