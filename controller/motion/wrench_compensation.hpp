// From what the sensor reads to what the user's hand does: bias and the tool's weight taken off, expressed at the tool.
//
// The sensor reads the wrench w_S that the tool side exerts on the flange side, in S and about S's origin:
//
//   w_S = bias + (hand's wrench) + (weight of the tool) − (inertia of the tool)
//
// The weight, m R_SW g at the tool's centre of mass c, is subtracted; the inertia is not: a handle of mass m behind the
// sensor is felt in full, so (26) gets the wanted mass less m. The bias is what a reading at rest, with no hand on the
// handle, has over the weight.
#pragma once

#include <cstdint>

#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class WrenchCompensation {
 public:
  explicit WrenchCompensation(const description::Cell& cell);

  // Weight of the tool about S's origin, in S, with the sensor held at R_WS.
  [[nodiscard]] models::Wrench tool_weight_S(const models::Mat3& R_WS) const noexcept;

  // Adds one reading at rest to the average that becomes the bias.
  void add_tare_sample(const models::Wrench& reading_S, const models::Mat3& R_WS) noexcept;
  // Takes the average so far as the bias; at least one sample must have been added.
  void finish_tare() noexcept;
  // Largest deviation of a sample from the running mean, in N: the handle was touched if it exceeds the noise.
  [[nodiscard]] double tare_spread_N() const noexcept { return tare_spread_N_; }
  // Of one tare sample's force, per axis: the standard deviation of the noisiest one, in N. After finish_tare().
  [[nodiscard]] double noise_N() const noexcept;
  // False: what was noise_N has a memory from sample to sample, such as a hand's motion has, or a sensor's own filter.
  [[nodiscard]] bool noise_is_white() const noexcept;
  [[nodiscard]] double tare_samples() const noexcept { return static_cast<double>(tare_count_); }
  // The tool's own, behind the sensor.
  [[nodiscard]] double tool_mass_kg() const noexcept { return mass_kg_; }
  // Nobody holds the handle, so what is left of the reading is bias: by so much of it at most in each axis of S.
  void follow_bias(const models::Wrench& rest_S, double most_N, double most_Nm) noexcept;
  // By how much the force's bias has gone since the tare, in N.
  [[nodiscard]] double drift_N() const noexcept { return drift_S_.force.norm(); }
  [[nodiscard]] const models::Wrench& bias_S() const noexcept { return bias_S_; }

  // The hand's wrench about T's origin, in W.
  [[nodiscard]] models::Wrench hand_wrench_W(const models::Wrench& reading_S, const models::Mat3& R_WS) const noexcept;

  // What such a wrench adds to the reading: the inverse of hand_wrench_W().
  [[nodiscard]] models::Wrench reading_S(const models::Wrench& hand_W, const models::Mat3& R_WS) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(bias_S_.force, bias_S_.torque, tare_sum_S_.force, tare_sum_S_.torque, tare_squares_S_, tare_first_S_,
          tare_last_S_, tare_steps_S_, drift_S_.force, drift_S_.torque, tare_count_, tare_spread_N_);
  }

 private:
  [[nodiscard]] models::Vec3 tare_variance_S() const noexcept;

  double mass_kg_;
  models::Vec3 centre_of_mass_S_;
  models::Vec3 handle_S_;  // from S's origin to T's
  models::Vec3 gravity_W_;
  models::Wrench bias_S_;
  models::Wrench tare_sum_S_;
  models::Vec3 tare_squares_S_ = models::Vec3::Zero();  // of the forces less the first one
  models::Vec3 tare_first_S_ = models::Vec3::Zero();
  models::Vec3 tare_last_S_ = models::Vec3::Zero();
  models::Vec3 tare_steps_S_ = models::Vec3::Zero();  // squares of the differences between one and the next
  models::Wrench drift_S_;                            // of the bias, since the tare; in it
  std::int64_t tare_count_ = 0;
  double tare_spread_N_ = 0.0;
};

}  // namespace proxarm::controller
