// A hand for simulation, as its file states it: what it is made of and the motion that it intends.
//
// The hand holds the tool's point T through stiffness and damping and follows its intention: waypoints, joined by
// minimum-jerk motions, plus a sum of sines. With s = (t − t_i)/(t_{i+1} − t_i) in [0, 1]:
//   x(t) = x_i + (x_{i+1} − x_i)(10 s³ − 15 s⁴ + 6 s⁵) + Σ_j a_j d_j sin(2π f_j t + φ_j)
// The tool's orientation is held and led in the same way: the intention is a rotation vector in W, from the orientation
// of the start. Without a turning stiffness and damping the hand doesn't twist the handle.
// It rests at the first waypoint before its time and at the last one after it. No waypoint: it holds the start.
//
// Or both come as data, from CSV files: a trajectory in the place of waypoints, and a force that it exerts beside that
// of its grip. A hand with a force and nothing to follow has no grip unless the file gives it one: what it exerts is
// what the file says, whatever the tool does.
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
  double time_s = 0.0;               // strictly rising along the list
  std::array<double, 3> offset_m{};  // in W, from where the tool is at the start
  std::array<double, 3> turn_rad{};  // rotation vector in W, from the tool's orientation at the start
};

struct Sine {
  double frequency_Hz = 1.0;
  double amplitude_m = 0.0;    // of the tool's place, along `direction`
  double amplitude_rad = 0.0;  // of its orientation, about `direction`
  double phase_rad = 0.0;
  std::array<double, 3> direction{1.0, 0.0, 0.0};  // in W; scaled to length 1 by load_hand
};

// From this time on the hand holds the handle so; a grip changes evenly over grip_change_s.
struct Grip {
  double time_s = 0.0;  // strictly rising along the list
  double stiffness_N_per_m = 0.0;
  double damping_Ns_per_m = 0.0;
};
inline constexpr double grip_change_s = 0.1;

// How a grip varies by itself: stiffness and damping times 1 + share u(t), with u from 0 at the hand's beginning to
// another number between −1 and 1 every interval_s, evenly distributed and drawn by the seed, minimum jerk in between.
struct GripVariation {
  double share = 0.0;  // 0: it doesn't
  double interval_s = 0.5;
  std::uint64_t seed = 1;
};

struct HandDescription {
  std::filesystem::path file;
  std::string name;
  double mass_kg = 1.0;  // of the hand, beyond the handle; felt by the force sensor
  double stiffness_N_per_m = 500.0;
  double damping_Ns_per_m = 20.0;
  double max_force_N = std::numeric_limits<double>::infinity();  // it pulls by this at most
  // Of the hand's rotation about the tool's point; all 0: it doesn't twist the handle.
  double inertia_kg_m2 = 0.0;  // beyond the handle's, the same about each axis; the sensor feels it
  double turning_stiffness_Nm_per_rad = 0.0;
  double turning_damping_Nms_per_rad = 0.0;
  double max_torque_Nm = std::numeric_limits<double>::infinity();
  std::vector<Grip> grips;  // after the one above
  GripVariation variation;  // of all of them, and of the grip on the orientation
  std::vector<Waypoint> waypoints;
  std::vector<Sine> multisine;
  std::vector<TimedVector> trajectory;            // instead of waypoints; m, in W, from its first row on
  std::vector<TimedVector> force;                 // N, in W; none before its first row and after its last
  std::vector<std::filesystem::path> data_files;  // that both were read from

  [[nodiscard]] bool twists() const noexcept {
    return turning_stiffness_Nm_per_rad > 0.0 || turning_damping_Nms_per_rad > 0.0;
  }
};

// The stiffest of all its grips, as stiff as it varies to.
Grip tightest_grip(const HandDescription& hand) noexcept;

// Throws SetupError, with file, line and key.
HandDescription load_hand(const std::filesystem::path& file);
// The same of a file that has been read already.
HandDescription read_hand(const YamlNode& root);

}  // namespace proxarm::description
