#include "controller/handle/hand_force.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Mat3;
using models::Vec3;
using models::Wrench;

constexpr double filter_s = 0.015;
// The line of action of a smaller force isn't known well enough: half of its lever would be uncertainty.
constexpr double least_N = 0.3, least_noises = 20.0;
// A force counts as left over from the tare if it equals the opposite of beside_zero_S to within this share of
// beside_zero_S. The share allows for a hand whose push changed during the tare.
constexpr double left_share = 0.3;
// Smallest force that counts as left over, as a share of the smallest force with a known line. It can be smaller, since
// the tare's mean is known better than a single force.
constexpr double least_left = 0.3;

}  // namespace

void HandForce::step(const Wrench& reading_W, const Mat3& R_WS, const Vec3& v_W, double noise_N,
                     const Vec3& beside_zero_S) noexcept {
  State& s = state_;
  const double T = period_s_, lag = T / (T + lag_s_ / 3.0), share = T / (T + filter_s);
  s.a1_W += lag * ((v_W - s.v_k1_W) / T - s.a1_W);
  s.a2_W += lag * (s.a1_W - s.a2_W);
  s.a3_W += lag * (s.a2_W - s.a3_W);
  s.v_k1_W = v_W;
  const Vec3 inertia_W = tool_.mass_kg * s.a3_W;
  s.wrench_W.force = reading_W.force + inertia_W;
  s.wrench_W.torque = reading_W.torque + (R_WS * (tool_.centre_S - tool_.handle_S)).cross(inertia_W);
  s.calm_W.force += share * (s.wrench_W.force - s.calm_W.force);
  s.calm_W.torque += share * (s.wrench_W.torque - s.calm_W.torque);
  const double calm_noise_N = noise_N * std::sqrt(T / (2.0 * filter_s));
  const double large_N = std::max(least_N, least_noises * calm_noise_N);
  s.left_by_tare = s.calm_W.force.norm() >= least_left * large_N &&
                   (s.calm_W.force + R_WS * beside_zero_S).norm() <= left_share * beside_zero_S.norm();
  const bool large = !s.left_by_tare && s.calm_W.force.norm() >= large_N;
  const Vec3 handle_W = R_WS * tool_.handle_S;
  s.at_handle = large && acts_at_handle(s.calm_W, handle_W, calm_noise_N);
  s.as_offset = large && !s.at_handle && acts_as_offset(s.calm_W, handle_W, calm_noise_N);
}

}  // namespace proxarm::controller
