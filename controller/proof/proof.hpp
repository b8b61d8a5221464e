// Whether an arm is as its cell says: joint signs, gear ratios and counts, the sensor's mounting, sign and scale.
//
// The arm stands in several poses, with one joint turned at a time, and the sensor is read there: once with the tool's
// weight alone, and at some poses also with a push in a stated direction d of W. If the cell is right, the readings are
//   F_S(k) = b + m R_SW(q_k) g (+ p R_SW(q_k) d),   b: the sensor's bias, p > 0: the push; both unknown
// A wrong sign or ratio of a joint turns R_SW. A sensor that is mounted otherwise turns F_S; one with another sign or
// scale multiplies it. Each such mistake is a hypothesis, of which two figures are computed:
//   ρ = √(Σ|F_S(k) − F̄_S − (model − its mean)|² / Σ|model − its mean|²)   over the readings without a push, and
//   α = the largest angle between a push as it was read (with it, less without it) and R_SW d.
// The proof succeeds if the cell as it is explains the readings (ρ and α are below their bounds) and no single mistake
// explains them about as well. Otherwise the mistakes that would explain them are listed, the best one first.
//
// What doesn't change the weight in S isn't shown by it. A joint about the vertical needs the pushes, whose directions
// are only as exact as a hand's. An offset of a joint is found only if it tilts the tool by more than ρ. Knows no bus.
#pragma once

#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::proof {

// Where the arm stands, by its motors' angles, and the direction d in which somebody pushes there (zero: nobody does).
// Precondition: d is zero or a unit vector.
struct Station {
  models::JointVector motor_rad;
  models::Vec3 push_W = models::Vec3::Zero();
};

struct Reading {
  Station station;
  models::JointVector motor_rad;  // by the encoders
  models::Vec3 force_S = models::Vec3::Zero();
  // For who asks how well the mean is known, too (controller/identification):
  models::Vec3 torque_S = models::Vec3::Zero();
  models::Wrench step_squares_S{};  // Σ(xᵢ₊₁ − xᵢ)² of the samples, by axis
  int samples = 0;
  double time_s = 0.0, lasted_s = 0.0;  // its end, since the first cycle; how long samples were taken
};

// The bound of ρ. A scale that is wrong by 15 % reaches it; one wrong joint in six makes five times as much.
inline constexpr double most_residual = 0.15;
// The bound of α: how well a hand keeps to a direction that it is told.
inline constexpr double most_angle_rad = 0.26;  // 15 degrees
// How far the arm moves from the pose in which it is found, at first, and then how far each joint is turned. A joint
// that only pushes can prove is turned twice as far.
inline constexpr double pose_rad = 0.3, turn_rad = 0.3;

// Throws SetupError for linear joints, and for a tool without mass.
void require_provable(const description::Cell& cell, const models::Arm& arm);

// The stations, in their order: a pose about `motor_rad` in which the weight shows as many joints as possible, that
// pose with each joint turned, and pushes where they are needed. Throws SetupError if the arm isn't provable, or if a
// joint's range leaves no room.
std::vector<Station> plan(const description::Cell& cell, const models::Arm& arm, const models::JointVector& motor_rad);

struct Explanation {
  std::string mistake;  // empty: the cell as it is
  double residual = 0.0, angle_rad = 0.0;

  [[nodiscard]] bool explains() const noexcept { return residual <= most_residual && angle_rad <= most_angle_rad; }
};

struct Verdict {
  bool proven = false;
  Explanation as_it_is;
  std::vector<Explanation> mistakes;  // those that would explain the readings, the best one first
};

Verdict judge(const description::Cell& cell, const models::Arm& arm, const std::vector<Reading>& readings);

// The verdict in lines of text, for people.
std::string text(const Verdict& verdict);

}  // namespace proxarm::proof
