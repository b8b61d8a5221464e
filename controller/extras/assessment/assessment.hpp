// Assesses on the simulated arm what a cell's arm does to a person near it: how far the arm moves on when it is stopped
// at full speed, and how hard it presses on a body in its way.
//
// A trial is a session in virtual time: a hand leads the tool straight along a direction through free space, at the
// speed that the cell allows. The first trial is undisturbed and shows when the tool is fastest. The other trials are
// the same up to that time. Then one of two things happens:
// - The arm is stopped. Category 0: power off, brakes close. Category 1: controlled stop, then power off. Category 2:
//   controlled stop, drives stay on.
// - A body appears: a one-sided spring across the tool's way, in front of something rigid. It presses on the handle,
//   where the sensor measures the force, or on the arm before the sensor, where the force isn't measured.
//
// Trials run in several poses, and in both directions of the three axes of W. If the arm moves in fewer dimensions,
// trials run along the axes of the tool's space. The worst figures are reported.
//
// The simulation uses the cell file's values under `simulation:`. It certifies nothing.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "controller/extras/assessment/thresholds.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::assessment {

enum class Stop : std::uint8_t { none, category_0, category_1, category_2 };

// The body in the tool's way. `felt`: whether it presses on the handle, where the sensor measures the force.
struct Body {
  double stiffness_N_per_m = 0.0;  // 0: no body
  models::Vec3 surface_W = models::Vec3::Zero(), normal_W = models::Vec3::UnitX();
  bool felt = true;
};

struct Trial {
  std::vector<double> start_rad;
  models::Vec3 direction_W = models::Vec3::UnitX();
  Stop stop = Stop::none;
  double at_s = 0.0;  // when the arm is stopped or the body appears, since power-on
  Body body{};
};

struct Sample {
  double time_s = 0.0;  // since power-on
  models::Vec3 tool_W = models::Vec3::Zero(), velocity_W = models::Vec3::Zero();
};

struct TrialResult {
  std::vector<Sample> samples;  // a sample for each step of the physics
  double stopped_at_s = 0.0;    // when the stop was ordered or the power was cut
  std::string end;              // the fault that ended the session, in words; empty: no fault
};

// Runs a trial and returns its result. Throws SetupError if the session can't begin.
using ArmTrial = std::function<TrialResult(const Trial&)>;

// Distance in m. The tool counts as stopped once it stays within this distance of its final place. The distance is
// smaller than the yielding of skin. After a stop, elastic gears may let the tool oscillate within it for some tenths
// of a second.
inline constexpr double stopped_within_m = 1e-3;
// Speed in m/s. A tool slower than this at the end of a trial counts as at rest. It is the speed of an oscillation of
// 0.1 mm at 16 Hz, an arm's first mode.
inline constexpr double rest_m_per_s = 0.01;

struct StopFigure {
  Stop stop = Stop::none;
  double from_m_per_s = 0.0, time_s = 0.0, distance_m = 0.0;
  bool at_rest = true;  // whether the tool is at rest at the end of the trial
  int pose = 0;
  std::string direction;  // "+x"
};

struct ClampFigure {
  bool felt = true;
  double stiffness_N_per_m = 0.0;
  // Largest force: transient_N in the first half second of the contact, quasi_static_N after it.
  double transient_N = 0.0, quasi_static_N = 0.0;
  double energy_J = 0.0;    // largest energy of the spring, k x²/2
  double left_N = 0.0;      // force at the end of the trial
  double at_m_per_s = 0.0;  // the tool's speed at contact
  int pose = 0;             // the pose with the largest transient force
  std::string direction{}, end{};
};

struct Assessment {
  std::vector<std::vector<double>> poses_rad;
  // For each category, the stop with the largest distance. at_rest: whether all trials of the category ended at rest.
  std::vector<StopFigure> stops;
  std::vector<double> longest_stop_s;  // for each category, the longest time over all poses
  // For each place and stiffness of the body, the largest figures of all trials; speed, pose and direction are those of
  // the largest transient force.
  std::vector<ClampFigure> clamps;
};

// Returns the start pose and poses near it, within ranges, workspace and keep-out boxes. None of them is much nearer to
// a singularity than the start. Each call returns the same poses; fewer than `count` if there aren't enough.
std::vector<std::vector<double>> poses_about_start(const description::Cell& cell, const models::Arm& arm, int count);

// Returns the figures of a trial in which the arm was stopped.
StopFigure stop_figure(const TrialResult& result);
// Returns the figures of a trial with a body.
ClampFigure clamp_figure(const Body& body, const TrialResult& result);

// A direction in which a hand leads the tool.
struct Direction {
  // "+x", or "+1", "+2" if the axes of the tool's space aren't along the axes of W.
  std::string name;
  models::Vec3 along_W = models::Vec3::UnitX();
};
std::vector<Direction> directions_of(const models::ToolSpace& space);

Assessment assess(const std::vector<std::vector<double>>& poses_rad, const std::vector<Direction>& directions,
                  const Thresholds& thresholds, const ArmTrial& run_trial);

}  // namespace proxarm::assessment
