#include "controller/limits/sent_point.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::Vec3;

namespace {

constexpr double tolerance_m = 1e-11;  // equals the tolerance in limited_algorithm.hpp: 10 nm/s at 1 kHz
// Limits that bound the motion of c, not its place. If only these limits are active, c follows p as fast as they allow.
constexpr auto catches_up =
    static_cast<std::uint16_t>(static_cast<unsigned>(Limit::speed) | static_cast<unsigned>(Limit::acceleration) |
                               static_cast<unsigned>(Limit::power) | static_cast<unsigned>(Limit::leash));
// Most sweeps of Dykstra's algorithm in a step, if the sets have almost no common point.
constexpr int most_sweeps = 300;

}  // namespace

SentPoint::SentPoint(const description::CellLimits& limits, double horizon_s, double period_s)
    : omega_rad_per_s_(2.0 * std::numbers::pi * limits.setpoint_bandwidth_Hz) {
  set_period(period_s);
  want(horizon_s);
  state_.horizon_s = state_.wanted_s;
}

void SentPoint::set_period(double period_s) noexcept {
  period_s_ = period_s;
  decay_ = std::exp(-omega_rad_per_s_ * period_s);
  fading_ = std::exp(-period_s / fading_s);
}

void SentPoint::want(double horizon_s) noexcept {
  if (std::isfinite(horizon_s) && horizon_s >= 0.0) state_.wanted_s = horizon_s;
}

void SentPoint::start(const Vec3& q_W) noexcept {
  state_.c_k1_W = state_.c_k2_W = q_W;
  state_.beside_W.setZero();
  state_.changes = false;
  start_filter(q_W, Vec3::Zero());
}

void SentPoint::resume(const Vec3& c_W, const Vec3& q_W, const Vec3& velocity_W) noexcept {
  state_.c_k1_W = c_W;
  state_.c_k2_W = c_W - period_s_ * velocity_W;
  take_up_change();
  start_filter(q_W, velocity_W);
}

void SentPoint::advance_horizon() noexcept {
  const double most_s = horizon_rate * period_s_;
  state_.horizon_s += std::clamp(state_.wanted_s - state_.horizon_s, -most_s, most_s);
}

void SentPoint::step(const Vec3& q_W, const Vec3& predicted_W, const StepLimits& limits) noexcept {
  filter(q_W);
  const Vec3 coasting_W = 2.0 * state_.c_k1_W - state_.c_k2_W;
  state_.beside_W = state_.changes ? Vec3(coasting_W - predicted_W) : Vec3(fading_ * state_.beside_W);
  state_.changes = false;
  Vec3 way = predicted_W + state_.beside_W - state_.c_k1_W;
  sets_.set(limits, models::Mat3::Identity());
  active_ = {};
  if (!sets_.contains(way, tolerance_m, true) || !sets_.followed(way, state_.c_k1_W + way)) {
    int sweeps = most_sweeps;
    auto nearest = sets_.nearest(way, true, sweeps);
    if (!sets_.contains(nearest.x, 1e-9, true)) {  // leash and power give way
      sweeps = most_sweeps;
      nearest = sets_.nearest(way, false, sweeps);
    }
    active_ = nearest.active;
    way = sets_.contains(nearest.x, 1e-9, false) ? nearest.x : sets_.draw_back(nearest.x, false);
    if ((active_.kinds & catches_up) != active_.kinds) state_.beside_W = state_.c_k1_W + way - predicted_W;
  }
  state_.c_k2_W = state_.c_k1_W;
  state_.c_k1_W += way;
}

// Starts the filter's state behind q_W by 2/ω times the velocity, as if q_W had always moved at this velocity.
void SentPoint::start_filter(const Vec3& q_W, const Vec3& velocity_W) noexcept {
  state_.v_W = velocity_W;
  state_.x_W = q_W;
  if (omega_rad_per_s_ > 0.0) state_.x_W -= 2.0 / omega_rad_per_s_ * velocity_W;
}

// Filters q_W with the equations with which ElasticSetpoint::step() filters the link angles.
void SentPoint::filter(const Vec3& q_W) noexcept {
  if (!(omega_rad_per_s_ > 0.0)) return;
  const double omega = omega_rad_per_s_, T = period_s_;
  const Vec3 e = state_.x_W - q_W;
  const Vec3 c = state_.v_W + omega * e;
  state_.x_W = q_W + decay_ * (e + T * c);
  state_.v_W = decay_ * (state_.v_W - omega * T * c);
}

}  // namespace proxarm::controller
