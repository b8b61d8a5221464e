// Checks that an arm matches its cell: joint signs, gear ratios and counts, and the sensor's mounting, sign and scale.
//
// The arm stands in several poses, with one joint turned at a time, and the sensor is read in each pose. Readings are
// taken with the tool's weight alone, and at some poses also with a push in a given direction d of W. If the cell is
// right, the readings are
//   F_S(k) = b + m R_SW(q_k) g (+ p R_SW(q_k) d),   b: the sensor's bias, p > 0: the push; both unknown
// A mistake in the cell changes the readings. A wrong sign or ratio of a joint turns R_SW. A wrong mounting of the
// sensor turns F_S. A wrong sign or scale of the sensor multiplies F_S. Each of these mistakes is a hypothesis with two
// figures, where the model is the right side above, with the mistake:
//   ρ = √(Σ|F_S(k) − F̄_S − (model − its mean)|² / Σ|model − its mean|²)   over the readings without a push
//   α = the largest angle between a measured push (reading with the push minus reading without it) and the model's
//       p R_SW d
// The proof succeeds if the cell as it is explains the readings (ρ and α are within their bounds) and no single mistake
// explains them about as well. Otherwise the mistakes that explain the readings are listed, the best explanation first.
//
// A mistake that doesn't change the weight in S isn't found by the weight. So a joint about the vertical is tested by
// pushes, which are only as exact as a hand. A wrong offset of a joint is found only if it tilts the tool by more than
// ρ. This file uses no bus.
#pragma once

#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::proof {

// A pose of the arm, by its motors' angles, and the direction d of a push there. Precondition: d is a unit vector, or
// zero for no push.
struct Station {
  models::JointVector motor_rad;
  models::Vec3 push_W = models::Vec3::Zero();
};

struct Reading {
  Station station;
  models::JointVector motor_rad;  // the motors' angles by the encoders
  models::Vec3 force_S = models::Vec3::Zero();
  // For estimates of the accuracy of the mean force (controller/extras/identification):
  models::Vec3 torque_S = models::Vec3::Zero();
  models::Wrench step_squares_S{};  // Σ(xᵢ₊₁ − xᵢ)² of the samples, by axis
  int samples = 0;
  // time_s: end of the reading, since the first cycle. lasted_s: duration of sampling.
  double time_s = 0.0, lasted_s = 0.0;
};

// The bound of ρ. A scale error of 15 % reaches it; one wrong joint of six exceeds it by a factor of five.
inline constexpr double most_residual = 0.15;
// The bound of α: how well a hand follows a given direction.
inline constexpr double most_angle_rad = 0.26;  // 15 degrees
// pose_rad: how far each joint may first move from the arm's initial pose. turn_rad: how far each joint is then turned.
// A joint that only pushes can prove is turned twice as far.
inline constexpr double pose_rad = 0.3, turn_rad = 0.3;

// Throws SetupError for linear joints, and for a tool without mass.
void require_provable(const description::Cell& cell, const models::Arm& arm);

// Returns the stations in order: a pose about `motor_rad` in which the weight shows as many joints as possible; this
// pose with each joint turned; pushes where they are needed. Throws SetupError if the arm isn't provable, or if a
// joint's range leaves no room.
std::vector<Station> plan(const description::Cell& cell, const models::Arm& arm, const models::JointVector& motor_rad);

struct Explanation {
  std::string mistake;  // empty: the cell as it is, without a mistake
  double residual = 0.0, angle_rad = 0.0;

  [[nodiscard]] bool explains() const noexcept { return residual <= most_residual && angle_rad <= most_angle_rad; }
};

struct Verdict {
  bool proven = false;
  Explanation as_it_is;
  std::vector<Explanation> mistakes;  // the mistakes that explain the readings, the best explanation first
};

Verdict judge(const description::Cell& cell, const models::Arm& arm, const std::vector<Reading>& readings);

// Returns the verdict in lines of text, for people.
std::string text(const Verdict& verdict);

}  // namespace proxarm::proof
