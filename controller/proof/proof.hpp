// Whether an arm is as its cell says: joint signs, gear ratios and counts, the sensor's mounting, sign and scale.
//
// The arm stands in several poses, one joint turned at a time, and the sensor is read there: once with the tool's
// weight alone, and in some with a push in a stated direction d of W. With the cell being right, the readings are
//   F_S(k) = b + m R_SW(q_k) g (+ p R_SW(q_k) d),   b: the sensor's bias, p > 0: how hard somebody pushes, both unknown
// A wrong sign or ratio of a joint turns R_SW, a sensor that is mounted otherwise turns F_S, one with another sign or
// scale multiplies it. Each such mistake is a hypothesis; what is asked of each is
//   ρ = √(Σ|F_S(k) − F̄_S − (model − its mean)|² / Σ|model − its mean|²)   of the readings without a push, and
//   α = the largest angle between a push as it was read (with it, less without it) and R_SW d.
// The proof is given if the cell as it is explains the readings (ρ and α below their bounds) and no single mistake
// would explain them about as well. If it isn't, the mistakes that would are told, the best one first.
//
// What the weight can't show it doesn't: a joint about the vertical needs the pushes, and their directions are as good
// as a hand's. Offsets of joints aren't proven beyond what tilts the tool by ρ. Knows no bus.
#pragma once

#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::proof {

// Where the arm stands, by its motors' angles, and whether somebody pushes there (d, of length 1; zero: nobody).
struct Station {
  models::JointVector motor_rad;
  models::Vec3 push_W = models::Vec3::Zero();
};

struct Reading {
  Station station;
  models::JointVector motor_rad;  // by the encoders
  models::Vec3 force_S = models::Vec3::Zero();
};

// Of what differs: 0.15 of the weight's change is a scale off by as much, a fifth of what one wrong joint in six does.
inline constexpr double most_residual = 0.15;
// Of a push: what a hand that is told a direction keeps to.
inline constexpr double most_angle_rad = 0.26;  // 15 degrees
// From the pose in which the arm is found, to begin with, and from there for each joint; of one that only pushes can
// prove, twice.
inline constexpr double pose_rad = 0.3, turn_rad = 0.3;

// Throws SetupError for linear joints, and for a tool without mass.
void require_provable(const description::Cell& cell, const models::Arm& arm);

// The stations, in their order: a pose about `motor_rad` in which the weight shows as many joints as it can, that pose
// with each joint turned, and pushes where they are needed. Throws SetupError where it isn't provable, or a range
// leaves no room.
std::vector<Station> plan(const description::Cell& cell, const models::Arm& arm, const models::JointVector& motor_rad);

struct Explanation {
  std::string mistake;  // empty: the cell as it is
  double residual = 0.0, angle_rad = 0.0;

  [[nodiscard]] bool explains() const noexcept { return residual <= most_residual && angle_rad <= most_angle_rad; }
};

struct Verdict {
  bool proven = false;
  Explanation as_it_is;
  std::vector<Explanation> mistakes;  // that would explain the readings, the best first
};

Verdict judge(const description::Cell& cell, const models::Arm& arm, const std::vector<Reading>& readings);

// In lines, for people.
std::string text(const Verdict& verdict);

}  // namespace proxarm::proof
