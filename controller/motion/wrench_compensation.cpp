#include "controller/motion/wrench_compensation.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

using models::Mat3;
using models::Vec3;
using models::Wrench;

WrenchCompensation::WrenchCompensation(const description::Cell& cell)
    : mass_kg_(cell.tool.mass_kg),
      centre_of_mass_S_(cell.tool.centre_of_mass_S_m.data()),
      handle_S_(cell.tool.handle_S.position_m.data()),
      gravity_W_(cell.gravity_W_m_per_s2.data()) {}

Wrench WrenchCompensation::tool_weight_S(const Mat3& R_WS) const noexcept {
  const Vec3 weight_S = mass_kg_ * (R_WS.transpose() * gravity_W_);
  return {weight_S, centre_of_mass_S_.cross(weight_S)};
}

void WrenchCompensation::start_tare() noexcept {
  tare_sum_S_ = {};
  tare_count_ = 0;
  tare_spread_N_ = 0.0;
  tare_squares_S_.setZero();
  tare_steps_S_.setZero();
  tare_before_S_.setZero();
  tare_before_ = 0;
  tare_largest_N_ = tare_next_N_ = 0.0;
}

void WrenchCompensation::add_tare_sample(const Wrench& reading_S, const Mat3& R_WS) noexcept {
  const Wrench weight_S = tool_weight_S(R_WS);
  const Vec3 force = reading_S.force - weight_S.force;
  if (tare_count_ == 0) tare_first_S_ = tare_last_S_ = force;
  tare_steps_S_ += (force - tare_last_S_).cwiseAbs2();
  const double step_N = (force - tare_last_S_).norm();
  tare_next_N_ = std::max(tare_next_N_, std::min(step_N, tare_largest_N_));
  if (step_N > tare_largest_N_) {
    tare_largest_N_ = step_N;
    tare_before_S_ = tare_sum_S_.force;
    tare_before_ = tare_count_;
  }
  tare_last_S_ = force;
  tare_squares_S_ += (force - tare_first_S_).cwiseAbs2();
  if (tare_count_ > 0) {
    const Vec3 mean = tare_sum_S_.force / static_cast<double>(tare_count_);
    tare_spread_N_ = std::max(tare_spread_N_, (force - mean).norm());
  }
  tare_gravity_S_ = R_WS.transpose() * gravity_W_;
  tare_sum_S_.force += force;
  tare_sum_S_.torque += reading_S.torque - weight_S.torque;
  ++tare_count_;
}

void WrenchCompensation::finish_tare() noexcept {
  bias_S_.force = tare_sum_S_.force / static_cast<double>(tare_count_);
  bias_S_.torque = tare_sum_S_.torque / static_cast<double>(tare_count_);
  drift_S_ = {};
  learnt_gravity_S_ = tare_gravity_S_;
}

Vec3 WrenchCompensation::tare_jump_S() const noexcept {
  constexpr double kept_share = 0.2;
  const auto before = static_cast<double>(tare_before_), after = static_cast<double>(tare_count_ - tare_before_);
  if (before < 1.0 || after < 1.0 || tare_next_N_ > kept_share * tare_largest_N_) return Vec3::Zero();
  const Vec3 jump_S = (tare_sum_S_.force - tare_before_S_) / after - tare_before_S_ / before;
  return jump_S.norm() >= (1.0 - kept_share) * tare_largest_N_ ? jump_S : Vec3(Vec3::Zero());
}

void WrenchCompensation::set_tool(double mass_kg, const Vec3& centre_S) noexcept {
  const Vec3 moment = mass_kg * centre_S - mass_kg_ * centre_of_mass_S_;
  bias_S_.force -= (mass_kg - mass_kg_) * learnt_gravity_S_;
  bias_S_.torque -= moment.cross(learnt_gravity_S_);
  mass_kg_ = mass_kg;
  centre_of_mass_S_ = centre_S;
}

Vec3 WrenchCompensation::turned_gravity_S(const Mat3& R_WS) const noexcept {
  return learnt_gravity_S_ - R_WS.transpose() * gravity_W_;
}

void WrenchCompensation::learn_at(const Mat3& R_WS, double share) noexcept {
  learnt_gravity_S_ -= share * turned_gravity_S(R_WS);
}

// Returns the variance of the samples, (Σ(x − x₁)² − n (x̄ − x₁)²)/(n − 1). The first sample x₁ is subtracted in all
// sums, so that a large bias costs no digits.
Vec3 WrenchCompensation::tare_variance_S() const noexcept {
  const double n = tare_samples();
  const Vec3 mean = tare_sum_S_.force / n - tare_first_S_;
  return (tare_squares_S_ - n * mean.cwiseAbs2()) / (n - 1.0);
}

double WrenchCompensation::noise_N() const noexcept {
  if (tare_count_ < 2) return 0.0;
  return std::sqrt(std::max(0.0, tare_variance_S().maxCoeff()));
}

double WrenchCompensation::step_noise_N() const noexcept {
  if (tare_count_ < 2) return 0.0;
  return std::sqrt(tare_steps_S_.maxCoeff() / (2.0 * (tare_samples() - 1.0)));
}

// Compares Von Neumann's ratio, here Σ(xᵢ₊₁ − xᵢ)² divided by 2 Σ(xᵢ − x̄)², with 0.5 (J. von Neumann, Distribution of
// the ratio of the mean square successive difference to the variance, 1941). Values of this ratio:
//   1 to within 1/√n   white noise
//   (ωT)²/2            a motion at ω; 2 % at 30 Hz and 1 ms
//   1 − e^(−T/τ)       noise behind a first-order filter; 0.5 at 110 Hz and 1 ms
bool WrenchCompensation::noise_is_white() const noexcept {
  if (tare_count_ < 2) return true;
  int noisiest = 0;
  const double variance = tare_variance_S().maxCoeff(&noisiest);
  return tare_steps_S_[noisiest] >= 0.5 * 2.0 * (tare_samples() - 1.0) * variance;
}

void WrenchCompensation::follow_bias(const Wrench& rest_S, double most_N, double most_Nm) noexcept {
  const Vec3 force = rest_S.force.cwiseMax(-most_N).cwiseMin(most_N);
  const Vec3 torque = rest_S.torque.cwiseMax(-most_Nm).cwiseMin(most_Nm);
  bias_S_.force += force;
  bias_S_.torque += torque;
  drift_S_.force += force;
  drift_S_.torque += torque;
}

Wrench WrenchCompensation::hand_wrench_W(const Wrench& reading_S, const Mat3& R_WS) const noexcept {
  const Wrench weight_S = tool_weight_S(R_WS);
  const Vec3 force_S = reading_S.force - bias_S_.force - weight_S.force;
  const Vec3 torque_S = reading_S.torque - bias_S_.torque - weight_S.torque - handle_S_.cross(force_S);
  return {R_WS * force_S, R_WS * torque_S};
}

Wrench WrenchCompensation::reading_S(const Wrench& hand_W, const Mat3& R_WS) const noexcept {
  const Vec3 force_S = R_WS.transpose() * hand_W.force;
  return {force_S, R_WS.transpose() * hand_W.torque + handle_S_.cross(force_S)};
}

}  // namespace proxarm::controller
