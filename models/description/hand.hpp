// A simulated hand as its file describes it: its properties and the motion that it intends.
//
// The hand holds the tool's point T through stiffness and damping and follows its intention: waypoints, joined by
// minimum-jerk motions, plus a sum of sines. With s = (t − t_i)/(t_{i+1} − t_i) in [0, 1]:
//   x(t) = x_i + (x_{i+1} − x_i)(10 s³ − 15 s⁴ + 6 s⁵) + Σ_j a_j d_j sin(2π f_j t + φ_j)
// It holds and leads the tool's orientation in the same way, by a rotation vector in W from the orientation at the
// start. Without turning stiffness and damping the hand doesn't twist the handle. It rests at the first waypoint before
// that waypoint's time, at the last one after its time, and at the start without waypoints.
//
// CSV files may give a trajectory instead of waypoints, and a force in addition to the grip's. A hand with a force and
// nothing to follow has no grip unless its file states one: it then exerts exactly that force, wherever the tool goes.
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
  double time_s = 0.0;               // strictly increasing along the list
  std::array<double, 3> offset_m{};  // in W, from the tool's place at the start
  std::array<double, 3> turn_rad{};  // rotation vector in W, from the tool's orientation at the start
};

struct Sine {
  double frequency_Hz = 1.0;
  double amplitude_m = 0.0;    // of the tool's place, along `direction`
  double amplitude_rad = 0.0;  // of the tool's orientation, about `direction`
  double phase_rad = 0.0;
  std::array<double, 3> direction{1.0, 0.0, 0.0};  // in W; scaled to length 1 by load_hand
};

// The hand's grip from time_s on. Grips change linearly over grip_change_s.
struct Grip {
  double time_s = 0.0;  // strictly increasing along the list
  double stiffness_N_per_m = 0.0;
  double damping_Ns_per_m = 0.0;
};
inline constexpr double grip_change_s = 0.1;

// Random variation of a grip: stiffness and damping times 1 + share u(t). u is 0 at the hand's beginning; every
// interval_s it reaches a new number from −1 to 1, uniformly distributed and drawn by the seed, with minimum jerk in
// between.
struct GripVariation {
  double share = 0.0;  // 0: no variation
  double interval_s = 0.5;
  std::uint64_t seed = 1;
};

struct HandDescription {
  std::filesystem::path file;
  std::string name;
  double mass_kg = 1.0;  // of the hand, without the handle; the force sensor feels it
  double stiffness_N_per_m = 500.0;
  double damping_Ns_per_m = 20.0;
  double max_force_N = std::numeric_limits<double>::infinity();  // of its pull
  // For rotation about the tool's point; all 0: the hand doesn't twist the handle.
  double inertia_kg_m2 = 0.0;  // without the handle's, equal about each axis; the sensor feels it
  double turning_stiffness_Nm_per_rad = 0.0;
  double turning_damping_Nms_per_rad = 0.0;
  double max_torque_Nm = std::numeric_limits<double>::infinity();
  std::vector<Grip> grips;  // after the grip above
  GripVariation variation;  // of all grips, including the grip on the orientation
  std::vector<Waypoint> waypoints;
  std::vector<Sine> multisine;
  std::vector<TimedVector> trajectory;            // instead of waypoints; m, in W, relative to its first row
  std::vector<TimedVector> force;                 // N, in W; zero before its first row and after its last
  std::vector<std::filesystem::path> data_files;  // the files of both

  [[nodiscard]] bool twists() const noexcept {
    return turning_stiffness_Nm_per_rad > 0.0 || turning_damping_Nms_per_rad > 0.0;
  }
};

// The stiffest of all grips, at its stiffest variation.
Grip tightest_grip(const HandDescription& hand) noexcept;

// Throws SetupError, with file, line and key.
HandDescription load_hand(const std::filesystem::path& file);
// The same for a file that has already been read.
HandDescription read_hand(const YamlNode& root);

}  // namespace proxarm::description
