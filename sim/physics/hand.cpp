#include "sim/physics/hand.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::sim {

using models::Vec3;

Hand::Hand(const description::HandDescription& description, const Vec3& start_W)
    : description_(description), start_W_(start_W) {}

// Minimum jerk between waypoints, with s = (t − t_i)/(t_{i+1} − t_i):
//   x = x_i + (x_{i+1} − x_i)(10 s³ − 15 s⁴ + 6 s⁵),   ẋ = (x_{i+1} − x_i)(30 s² − 60 s³ + 30 s⁴)/(t_{i+1} − t_i)
// and on top of it Σ a_j d_j sin(2π f_j t + φ_j), from its own time zero on (before, it rests where that begins).
Intention Hand::intention(double time_s) const noexcept {
  Intention result;
  result.position_W = start_W_;
  const auto& points = description_.waypoints;
  std::size_t next = 0;
  while (next < points.size() && points[next].time_s <= time_s) ++next;
  if (!points.empty()) result.position_W += Vec3(points[next == 0 ? 0 : next - 1].offset_m.data());
  if (next > 0 && next < points.size()) {
    const auto &a = points[next - 1], &b = points[next];
    const double duration = b.time_s - a.time_s, s = (time_s - a.time_s) / duration;
    const Vec3 way = Vec3(b.offset_m.data()) - Vec3(a.offset_m.data());
    result.position_W += way * (s * s * s * (10.0 + s * (-15.0 + s * 6.0)));
    result.velocity_W = way * (30.0 * s * s * (1.0 - s) * (1.0 - s) / duration);
  }
  const double sine_time = time_s > 0.0 ? time_s : 0.0;
  for (const auto& sine : description_.multisine) {
    const double omega = 2.0 * M_PI * sine.frequency_Hz, angle = omega * sine_time + sine.phase_rad;
    const Vec3 way = sine.amplitude_m * Vec3(sine.direction.data());
    result.position_W += way * std::sin(angle);
    if (time_s > 0.0) result.velocity_W += way * (omega * std::cos(angle));
  }
  return result;
}

description::Grip Hand::grip(double time_s) const noexcept {
  description::Grip held{0.0, description_.stiffness_N_per_m, description_.damping_Ns_per_m};
  for (const description::Grip& next : description_.grips) {
    if (time_s < next.time_s) break;
    const double share = std::min(1.0, (time_s - next.time_s) / description::grip_change_s);
    held.stiffness_N_per_m += share * (next.stiffness_N_per_m - held.stiffness_N_per_m);
    held.damping_Ns_per_m += share * (next.damping_Ns_per_m - held.damping_Ns_per_m);
  }
  return held;
}

Vec3 Hand::force_W(double time_s, const Vec3& position_W, const Vec3& velocity_W) const noexcept {
  const Intention want = intention(time_s);
  const description::Grip held = grip(time_s);
  const Vec3 F =
      held.stiffness_N_per_m * (want.position_W - position_W) + held.damping_Ns_per_m * (want.velocity_W - velocity_W);
  const double length_N = F.norm();
  return length_N > description_.max_force_N ? Vec3(description_.max_force_N / length_N * F) : F;
}

}  // namespace proxarm::sim
