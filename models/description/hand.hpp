// Describes a simulated hand as its file does: the hand's properties, and the motion that the hand intends.
//
// The hand holds the tool's point T by a stiffness and a damping, and follows its intended motion. This motion is a
// series of waypoints, joined by minimum-jerk motions, plus a sum of sines. With s = (t − t_i)/(t_{i+1} − t_i) in [0,
// 1]:
//   x(t) = x_i + (x_{i+1} − x_i)(10 s³ − 15 s⁴ + 6 s⁵) + Σ_j a_j d_j sin(2π f_j t + φ_j)
// The hand leads the tool's orientation in the same way, by a rotation vector in W from the orientation at the start.
// Without turning stiffness and turning damping, the hand doesn't twist the handle. Before the time of the first
// waypoint the hand rests at this waypoint, after the time of the last waypoint it rests at that one, and without
// waypoints it rests at the start.
//
// CSV files may give a trajectory instead of waypoints, and a force in addition to the force of the grip. A hand with a
// force but without waypoints, trajectory and sines has no grip unless its file states one. Such a hand exerts exactly
// the force from the file, wherever the tool goes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "models/files/csv_file.hpp"

namespace proxarm::description {

class YamlNode;

struct Waypoint {
  double time_s = 0.0;               // strictly increasing in the list
  std::array<double, 3> offset_m{};  // in W, from the tool's position at the start
  std::array<double, 3> turn_rad{};  // rotation vector in W, from the tool's orientation at the start
};

struct Sine {
  double frequency_Hz = 1.0;
  double amplitude_m = 0.0;    // amplitude of the tool's position, along `direction`
  double amplitude_rad = 0.0;  // amplitude of the tool's orientation, about `direction`
  double phase_rad = 0.0;
  std::array<double, 3> direction{1.0, 0.0, 0.0};  // in W; scaled to length 1 by load_hand
};

// The hand's grip from time_s on. A change from one grip to the next is linear over grip_change_s.
struct Grip {
  double time_s = 0.0;  // strictly increasing in the list
  double stiffness_N_per_m = 0.0;
  double damping_Ns_per_m = 0.0;
};
inline constexpr double grip_change_s = 0.1;

// The random variation of a grip: stiffness and damping are multiplied by 1 + share u(t). u is 0 at the start of the
// hand's motion. Every interval_s, u reaches a new number, and between two numbers u changes with minimum jerk. The
// numbers are uniformly distributed from −1 to 1; `seed` determines them.
struct GripVariation {
  double share = 0.0;  // 0: no variation
  double interval_s = 0.5;
  std::uint64_t seed = 1;
};

struct HandDescription {
  std::filesystem::path file;
  std::string name;
  double mass_kg = 1.0;  // mass of the hand without the handle; the force sensor feels it
  double stiffness_N_per_m = 500.0;
  double damping_Ns_per_m = 20.0;
  double max_force_N = std::numeric_limits<double>::infinity();  // largest force of the grip
  // The hand's properties for rotation about the tool's point. If all of these are 0, the hand doesn't twist the
  // handle.
  double inertia_kg_m2 = 0.0;  // inertia without the handle's, equal about each axis; the sensor feels it
  double turning_stiffness_Nm_per_rad = 0.0;
  double turning_damping_Nms_per_rad = 0.0;
  double max_torque_Nm = std::numeric_limits<double>::infinity();
  std::vector<Grip> grips;  // the grips that follow the grip above
  GripVariation variation;  // variation of all grips, including the grip on the orientation
  std::vector<Waypoint> waypoints;
  std::vector<Sine> multisine;
  std::vector<TimedVector> trajectory;            // replaces waypoints; m, in W, relative to the trajectory's first row
  std::vector<TimedVector> force;                 // N, in W; zero before the first row and after the last row
  std::vector<std::filesystem::path> data_files;  // the files of trajectory and force

  [[nodiscard]] bool twists() const noexcept {
    return turning_stiffness_Nm_per_rad > 0.0 || turning_damping_Nms_per_rad > 0.0;
  }
};

// Returns the grip with the largest stiffness, at the largest value of the variation.
Grip tightest_grip(const HandDescription& hand) noexcept;

// Reads a hand's file. Throws SetupError, with file, line and key.
HandDescription load_hand(const std::filesystem::path& file);
// Does what load_hand() does, for a file that has already been read.
HandDescription read_hand(const YamlNode& root);

}  // namespace proxarm::description
