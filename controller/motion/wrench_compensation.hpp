// Computes the hand's wrench from the sensor's reading: subtracts bias and tool weight, and moves the rest to the tool.
//
// The sensor reads the wrench w_S of the tool side on the flange side, in S and about S's origin:
//
//   w_S = bias + (hand's wrench) + (weight of the tool) − (inertia of the tool)
//
// The weight, m R_SW g at the tool's centre of mass c, is subtracted. The inertia is not: the hand feels the full mass
// m behind the sensor, so (26) gets the wanted mass less m. The bias is the reading less the weight, with the arm at
// rest and nobody at the handle.
#pragma once

#include <cstdint>

#include "controller/handle/hand_force.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class WrenchCompensation {
 public:
  explicit WrenchCompensation(const description::Cell& cell);

  // Weight of the tool in S, about S's origin, with the sensor at R_WS.
  [[nodiscard]] models::Wrench tool_weight_S(const models::Mat3& R_WS) const noexcept;

  void start_tare() noexcept;
  // Adds a reading at rest to the average that becomes the bias.
  void add_tare_sample(const models::Wrench& reading_S, const models::Mat3& R_WS) noexcept;
  // Takes the average as the bias. Precondition: at least one sample.
  void finish_tare() noexcept;
  // Largest deviation of a sample from the running mean, in N. Above the noise: somebody touched the handle.
  [[nodiscard]] double tare_spread_N() const noexcept { return tare_spread_N_; }
  // Standard deviation of a sample's force in the noisiest axis, in N. Precondition: finish_tare() was called.
  [[nodiscard]] double noise_N() const noexcept;
  // The same, computed from the differences of successive samples, which contain almost no slow hand motion.
  [[nodiscard]] double step_noise_N() const noexcept;
  // False if successive samples are correlated, by a hand's motion or the sensor's own filter.
  [[nodiscard]] bool noise_is_white() const noexcept;
  // The largest change between two samples, in S, if it stayed: the means before and after differ by about as much, and
  // every other change is below a fifth of it. Otherwise zero.
  [[nodiscard]] models::Vec3 tare_jump_S() const noexcept;
  [[nodiscard]] double tare_samples() const noexcept { return static_cast<double>(tare_count_); }
  [[nodiscard]] HeldTool tool() const noexcept { return {mass_kg_, centre_of_mass_S_, handle_S_}; }
  // Corrects the figures of the mounted tool: the bias becomes the one that a tare with them would have found.
  void set_tool(double mass_kg, const models::Vec3& centre_S) noexcept;
  // Gravity in S when the bias was learnt, m/s²; and its difference from gravity at R_WS.
  [[nodiscard]] const models::Vec3& learnt_gravity_S() const noexcept { return learnt_gravity_S_; }
  [[nodiscard]] models::Vec3 turned_gravity_S(const models::Mat3& R_WS) const noexcept;
  // A share of the bias has been learnt anew, with the sensor at R_WS.
  void learn_at(const models::Mat3& R_WS, double share) noexcept;
  // Adds rest_S to the bias, at most most_N and most_Nm in each axis of S. Precondition: nobody holds the handle, so
  // that rest_S is bias.
  void follow_bias(const models::Wrench& rest_S, double most_N, double most_Nm) noexcept;
  [[nodiscard]] double drift_N() const noexcept { return drift_S_.force.norm(); }
  [[nodiscard]] const models::Wrench& bias_S() const noexcept { return bias_S_; }
  // The force's bias by the tare alone, without drift.
  [[nodiscard]] models::Vec3 tared_S() const noexcept { return bias_S_.force - drift_S_.force; }
  // The reading without bias: the hand's wrench and the tool's weight.
  [[nodiscard]] models::Wrench load_S(const models::Wrench& reading_S) const noexcept {
    return {reading_S.force - bias_S_.force, reading_S.torque - bias_S_.torque};
  }

  // The hand's wrench about T's origin, in W.
  [[nodiscard]] models::Wrench hand_wrench_W(const models::Wrench& reading_S, const models::Mat3& R_WS) const noexcept;

  // The part of the reading that a hand's wrench makes: the inverse of hand_wrench_W().
  [[nodiscard]] models::Wrench reading_S(const models::Wrench& hand_W, const models::Mat3& R_WS) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(bias_S_.force, bias_S_.torque, tare_sum_S_.force, tare_sum_S_.torque, tare_squares_S_, tare_first_S_,
          tare_last_S_, tare_steps_S_, tare_before_S_, tare_before_, tare_largest_N_, tare_next_N_, drift_S_.force,
          drift_S_.torque, tare_count_, tare_spread_N_, mass_kg_, centre_of_mass_S_, tare_gravity_S_,
          learnt_gravity_S_);
  }

 private:
  [[nodiscard]] models::Vec3 tare_variance_S() const noexcept;

  double mass_kg_;
  models::Vec3 centre_of_mass_S_;
  models::Vec3 handle_S_;  // T's origin from S's
  models::Vec3 gravity_W_;
  models::Wrench bias_S_;
  models::Wrench tare_sum_S_;
  models::Vec3 tare_squares_S_ = models::Vec3::Zero();  // Σ(x − x₁)² of the forces x; x₁: the first
  models::Vec3 tare_first_S_ = models::Vec3::Zero();
  models::Vec3 tare_last_S_ = models::Vec3::Zero();
  models::Vec3 tare_steps_S_ = models::Vec3::Zero();  // Σ(xᵢ₊₁ − xᵢ)²
  // For the largest change between two samples: sum and number of the samples before it; its size, and the second
  // largest.
  models::Vec3 tare_before_S_ = models::Vec3::Zero();
  std::int64_t tare_before_ = 0;
  double tare_largest_N_ = 0.0, tare_next_N_ = 0.0;
  models::Vec3 tare_gravity_S_ = models::Vec3::Zero(), learnt_gravity_S_ = models::Vec3::Zero();  // m/s²
  models::Wrench drift_S_;  // of the bias since the tare; included in bias_S_
  std::int64_t tare_count_ = 0;
  double tare_spread_N_ = 0.0;
};

}  // namespace proxarm::controller
