// Computes the hand's wrench from the sensor's reading: subtracts bias and tool weight, and converts the rest to a
// wrench about T's origin.
//
// The sensor reads the wrench w_S of the tool side on the flange side, in S and about S's origin:
//
//   w_S = bias + (hand's wrench) + (weight of the tool) − (inertia of the tool)
//
// The weight, m R_SW g at the tool's centre of mass c, is subtracted. The inertia isn't subtracted: the hand feels the
// full mass m behind the sensor, so the mass in (26) is the wanted mass less m. The bias is the reading less the
// weight, measured with the arm at rest and nobody at the handle.
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

  // Returns the weight of the tool in S, about S's origin, if the sensor's orientation is R_WS.
  [[nodiscard]] models::Wrench tool_weight_S(const models::Mat3& R_WS) const noexcept;

  void start_tare() noexcept;
  // Adds a reading at rest to the average that becomes the bias.
  void add_tare_sample(const models::Wrench& reading_S, const models::Mat3& R_WS) noexcept;
  // Makes the average the bias. Precondition: at least one sample.
  void finish_tare() noexcept;
  // Largest deviation of a sample from the mean of the samples before it, in N. If this deviation is larger than the
  // noise, somebody has touched the handle.
  [[nodiscard]] double tare_spread_N() const noexcept { return tare_spread_N_; }
  // Standard deviation of a sample's force in the noisiest axis, in N. Precondition: finish_tare() was called.
  [[nodiscard]] double noise_N() const noexcept;
  // The standard deviation of noise_N(), but computed from the differences of successive samples. A slow motion of a
  // hand hardly changes these differences.
  [[nodiscard]] double step_noise_N() const noexcept;
  // False if a hand's motion or the sensor's own filter correlates successive samples.
  [[nodiscard]] bool noise_is_white() const noexcept;
  // The jump of the force during the tare, in S: the mean after the largest change between two samples, less the mean
  // before it. Zero if this difference is smaller than 0.8 of the largest change, or if another change between two
  // samples is larger than a fifth of the largest change.
  [[nodiscard]] models::Vec3 tare_jump_S() const noexcept;
  [[nodiscard]] double tare_samples() const noexcept { return static_cast<double>(tare_count_); }
  [[nodiscard]] HeldTool tool() const noexcept { return {mass_kg_, centre_of_mass_S_, handle_S_}; }
  // Corrects the figures of the mounted tool, and sets the bias that a tare with these figures would have found.
  void set_tool(double mass_kg, const models::Vec3& centre_S) noexcept;
  // Gravity in S when the bias was learnt, m/s².
  [[nodiscard]] const models::Vec3& learnt_gravity_S() const noexcept { return learnt_gravity_S_; }
  // learnt_gravity_S() less the gravity in S at the sensor's orientation R_WS, m/s².
  [[nodiscard]] models::Vec3 turned_gravity_S(const models::Mat3& R_WS) const noexcept;
  // Call if a share of the bias has been learnt anew at the sensor's orientation R_WS.
  void learn_at(const models::Mat3& R_WS, double share) noexcept;
  // Adds rest_S to the bias, at most most_N and most_Nm in each axis of S. Precondition: nobody holds the handle, so
  // rest_S is the bias's drift.
  void follow_bias(const models::Wrench& rest_S, double most_N, double most_Nm) noexcept;
  [[nodiscard]] double drift_N() const noexcept { return drift_S_.force.norm(); }
  [[nodiscard]] const models::Wrench& bias_S() const noexcept { return bias_S_; }
  // The bias of the force that the tare found, without the drift since then.
  [[nodiscard]] models::Vec3 tared_S() const noexcept { return bias_S_.force - drift_S_.force; }
  // The reading without bias: the hand's wrench and the tool's weight.
  [[nodiscard]] models::Wrench load_S(const models::Wrench& reading_S) const noexcept {
    return {reading_S.force - bias_S_.force, reading_S.torque - bias_S_.torque};
  }

  // Returns the hand's wrench about T's origin, in W.
  [[nodiscard]] models::Wrench hand_wrench_W(const models::Wrench& reading_S, const models::Mat3& R_WS) const noexcept;

  // Returns the part of the reading that a hand's wrench makes; the inverse of hand_wrench_W().
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
  models::Vec3 handle_S_;  // position of T's origin
  models::Vec3 gravity_W_;
  models::Wrench bias_S_;
  models::Wrench tare_sum_S_;
  models::Vec3 tare_squares_S_ = models::Vec3::Zero();  // Σ(x − x₁)² over the forces x; x₁: the first force
  models::Vec3 tare_first_S_ = models::Vec3::Zero();
  models::Vec3 tare_last_S_ = models::Vec3::Zero();
  models::Vec3 tare_steps_S_ = models::Vec3::Zero();   // Σ(xᵢ₊₁ − xᵢ)²
  models::Vec3 tare_before_S_ = models::Vec3::Zero();  // sum of the forces before the largest change
  std::int64_t tare_before_ = 0;                       // number of samples before the largest change
  // Sizes of the largest and the second largest change between two samples.
  double tare_largest_N_ = 0.0, tare_next_N_ = 0.0;
  models::Vec3 tare_gravity_S_ = models::Vec3::Zero(), learnt_gravity_S_ = models::Vec3::Zero();  // m/s²
  models::Wrench drift_S_;  // the bias's drift since the tare; included in bias_S_
  std::int64_t tare_count_ = 0;
  double tare_spread_N_ = 0.0;
};

}  // namespace proxarm::controller
