// From what the sensor reads to the hand's wrench: bias and tool weight are subtracted; the rest is expressed at the
// tool.
//
// The sensor reads the wrench w_S that the tool side exerts on the flange side, in S and about S's origin:
//
//   w_S = bias + (hand's wrench) + (weight of the tool) − (inertia of the tool)
//
// The weight, m R_SW g at the tool's centre of mass c, is subtracted. The inertia is not: the mass m of the handle
// behind the sensor is felt in full, so (26) is given the wanted mass less m. The bias is the reading less the weight
// while the arm is at rest and nobody touches the handle.
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

  // Weight of the tool about S's origin, in S, with the sensor held at R_WS.
  [[nodiscard]] models::Wrench tool_weight_S(const models::Mat3& R_WS) const noexcept;

  // Forgets what was averaged.
  void start_tare() noexcept;
  // Adds one reading at rest to the average that becomes the bias.
  void add_tare_sample(const models::Wrench& reading_S, const models::Mat3& R_WS) noexcept;
  // Takes the average so far as the bias. Precondition: at least one sample was added.
  void finish_tare() noexcept;
  // Largest deviation of a sample from the running mean, in N. If it exceeds the noise, the handle was touched.
  [[nodiscard]] double tare_spread_N() const noexcept { return tare_spread_N_; }
  // The standard deviation of a single tare sample's force in the noisiest axis, in N. Precondition: finish_tare() was
  // called.
  [[nodiscard]] double noise_N() const noexcept;
  // The same by how samples differ from the ones before: of a hand's slow motion nothing is in it.
  [[nodiscard]] double step_noise_N() const noexcept;
  // False if successive samples are correlated, as a hand's motion or the sensor's own filter makes them.
  [[nodiscard]] bool noise_is_white() const noexcept;
  // The largest change from one sample to the next, if it stayed: the means before and after it differ by as much, and
  // no other change is a fifth of it; else zero. In S.
  [[nodiscard]] models::Vec3 tare_jump_S() const noexcept;
  [[nodiscard]] double tare_samples() const noexcept { return static_cast<double>(tare_count_); }
  // The tool behind the sensor.
  [[nodiscard]] HeldTool tool() const noexcept { return {mass_kg_, centre_of_mass_S_, handle_S_}; }
  // Other figures of the tool that hung there all along: the bias becomes what would have been learnt with them.
  void set_tool(double mass_kg, const models::Vec3& centre_S) noexcept;
  // Gravity in S where the bias was learnt, in m/s²; and that less the one at R_WS.
  [[nodiscard]] const models::Vec3& learnt_gravity_S() const noexcept { return learnt_gravity_S_; }
  [[nodiscard]] models::Vec3 turned_gravity_S(const models::Mat3& R_WS) const noexcept;
  // A share of the bias is learnt anew with the sensor held at R_WS.
  void learn_at(const models::Mat3& R_WS, double share) noexcept;
  // Adds rest_S to the bias, at most most_N and most_Nm in each axis of S. Precondition: nobody holds the handle, so
  // what is left of the reading is bias.
  void follow_bias(const models::Wrench& rest_S, double most_N, double most_Nm) noexcept;
  // How far the force's bias has drifted since the tare, in N.
  [[nodiscard]] double drift_N() const noexcept { return drift_S_.force.norm(); }
  [[nodiscard]] const models::Wrench& bias_S() const noexcept { return bias_S_; }
  // Of the force, by the tare alone.
  [[nodiscard]] models::Vec3 tared_S() const noexcept { return bias_S_.force - drift_S_.force; }
  // The reading without its bias: the hand's wrench and the tool's weight.
  [[nodiscard]] models::Wrench load_S(const models::Wrench& reading_S) const noexcept {
    return {reading_S.force - bias_S_.force, reading_S.torque - bias_S_.torque};
  }

  // The hand's wrench about T's origin, in W.
  [[nodiscard]] models::Wrench hand_wrench_W(const models::Wrench& reading_S, const models::Mat3& R_WS) const noexcept;

  // What a wrench of the hand adds to the reading: the inverse of hand_wrench_W().
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
  models::Vec3 handle_S_;  // from S's origin to T's
  models::Vec3 gravity_W_;
  models::Wrench bias_S_;
  models::Wrench tare_sum_S_;
  models::Vec3 tare_squares_S_ = models::Vec3::Zero();  // Σ(x − x₁)² of the forces x, x₁ being the first
  models::Vec3 tare_first_S_ = models::Vec3::Zero();
  models::Vec3 tare_last_S_ = models::Vec3::Zero();
  models::Vec3 tare_steps_S_ = models::Vec3::Zero();  // Σ(xᵢ₊₁ − xᵢ)²
  // The largest change from a sample to the next, and the second: the sum and number of the samples before the first.
  models::Vec3 tare_before_S_ = models::Vec3::Zero();
  std::int64_t tare_before_ = 0;
  double tare_largest_N_ = 0.0, tare_next_N_ = 0.0;
  models::Vec3 tare_gravity_S_ = models::Vec3::Zero(), learnt_gravity_S_ = models::Vec3::Zero();  // m/s²
  models::Wrench drift_S_;  // how far the bias has drifted since the tare; bias_S_ includes it
  std::int64_t tare_count_ = 0;
  double tare_spread_N_ = 0.0;
};

}  // namespace proxarm::controller
