#include "sim/physics/hand.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "models/geometry/tool_pose.hpp"

namespace proxarm::sim {

using models::Vec3;

namespace {

// Below this angle, only the first term of each series below is used. The next term is smaller by a factor of
// small_rad²/20.
constexpr double small_rad = 1e-4;

// Returns ω of R = exp([φ]ₓ):  ω = φ̇ + (1 − cos θ)/θ² φ × φ̇ + (θ − sin θ)/θ³ φ × (φ × φ̇), θ = |φ|
Vec3 angular_velocity(const Vec3& phi, const Vec3& rate) noexcept {
  const double angle = phi.norm();
  const bool small = angle < small_rad;
  const double a = small ? 0.5 : (1.0 - std::cos(angle)) / (angle * angle);
  const double b = small ? 1.0 / 6.0 : (angle - std::sin(angle)) / (angle * angle * angle);
  const Vec3 across = phi.cross(rate);
  return rate + a * across + b * phi.cross(across);
}

}  // namespace

Hand::Hand(const description::HandDescription& description, const models::Pose& start_W)
    : description_(description), start_W_(start_W.translation()), R_start_(start_W.linear()) {}

// Adds the minimum-jerk motion between waypoints, with s = (t − t_i)/(t_{i+1} − t_i):
//   x = x_i + (x_{i+1} − x_i)(10 s³ − 15 s⁴ + 6 s⁵),   ẋ = (x_{i+1} − x_i)(30 s² − 60 s³ + 30 s⁴)/(t_{i+1} − t_i)
void Hand::add_waypoints(double time_s, Intention& want) const noexcept {
  const auto& points = description_.waypoints;
  std::size_t next = 0;
  while (next < points.size() && points[next].time_s <= time_s) ++next;
  if (!points.empty()) {
    const auto& last = points[next == 0 ? 0 : next - 1];
    want.position_W += Vec3(last.offset_m.data());
    want.turn_W = Vec3(last.turn_rad.data());
  }
  if (next > 0 && next < points.size()) {
    const auto &a = points[next - 1], &b = points[next];
    const double duration = b.time_s - a.time_s, s = (time_s - a.time_s) / duration;
    const Vec3 way = Vec3(b.offset_m.data()) - Vec3(a.offset_m.data());
    want.position_W += way * (s * s * s * (10.0 + s * (-15.0 + s * 6.0)));
    want.velocity_W = way * (30.0 * s * s * (1.0 - s) * (1.0 - s) / duration);
    const Vec3 turn = Vec3(b.turn_rad.data()) - Vec3(a.turn_rad.data());
    want.turn_W += turn * (s * s * s * (10.0 + s * (-15.0 + s * 6.0)));
    want.turn_rate_W = turn * (30.0 * s * s * (1.0 - s) * (1.0 - s) / duration);
  }
}

namespace {

Vec3 value_of(const description::TimedVector& row) { return Vec3(row.value.data()); }

// Returns the slope, at row i, of the parabola through row i and its neighbours; 0 at the first and last row:
//   ẋ_i = (v₁ d₀ + v₀ d₁)/(d₀ + d₁),   v₀ = (x_i − x_{i−1})/d₀,  v₁ = (x_{i+1} − x_i)/d₁
Vec3 slope(const std::vector<description::TimedVector>& rows, std::size_t i) {
  if (i == 0 || i + 1 == rows.size()) return Vec3::Zero();
  const double d0 = rows[i].time_s - rows[i - 1].time_s, d1 = rows[i + 1].time_s - rows[i].time_s;
  const Vec3 v0 = (value_of(rows[i]) - value_of(rows[i - 1])) / d0;
  const Vec3 v1 = (value_of(rows[i + 1]) - value_of(rows[i])) / d1;
  return (v1 * d0 + v0 * d1) / (d0 + d1);
}

// Returns the index of the first row after this time, or the number of rows if there is no such row.
std::size_t row_after(const std::vector<description::TimedVector>& rows, double time_s) {
  const auto next =
      std::upper_bound(rows.begin(), rows.end(), time_s, [](double t, const auto& row) { return t < row.time_s; });
  return static_cast<std::size_t>(next - rows.begin());
}

}  // namespace

// Adds the motion along the trajectory. With s = (t − t_i)/d, d = t_{i+1} − t_i, the rows' places x₀ and x₁ and slopes
// m₀ and m₁:
//   x = x₀ + (x₁ − x₀)(3 s² − 2 s³) + d (m₀ (s − 2 s² + s³) + m₁ (s³ − s²))
void Hand::add_trajectory(double time_s, Intention& want) const noexcept {
  const auto& rows = description_.trajectory;
  if (rows.empty()) return;
  const std::size_t next = row_after(rows, time_s);
  if (next == 0 || next == rows.size()) {
    want.position_W += value_of(next == 0 ? rows.front() : rows.back());
    return;
  }
  const double d = rows[next].time_s - rows[next - 1].time_s, s = (time_s - rows[next - 1].time_s) / d;
  const Vec3 x0 = value_of(rows[next - 1]), way = value_of(rows[next]) - x0;
  const Vec3 m0 = slope(rows, next - 1), m1 = slope(rows, next);
  want.position_W +=
      x0 + way * (s * s * (3.0 - 2.0 * s)) + d * (m0 * (s * (1.0 - s) * (1.0 - s)) - m1 * (s * s * (1.0 - s)));
  want.velocity_W += way * (6.0 * s * (1.0 - s) / d) + m0 * ((1.0 - s) * (1.0 - 3.0 * s)) + m1 * (s * (3.0 * s - 2.0));
}

Vec3 Hand::data_force_W(double time_s) const noexcept {
  const auto& rows = description_.force;
  if (rows.empty() || time_s > rows.back().time_s) return Vec3::Zero();
  const std::size_t next = row_after(rows, time_s);
  if (next == 0) return Vec3::Zero();
  if (next == rows.size()) return value_of(rows.back());  // time_s is exactly the last row's time
  const double s = (time_s - rows[next - 1].time_s) / (rows[next].time_s - rows[next - 1].time_s);
  return (1.0 - s) * value_of(rows[next - 1]) + s * value_of(rows[next]);
}

// Returns the sum of the start position, the waypoints' motion, the trajectory and the multisine Σ a_j d_j sin(2π f_j t
// + φ_j). Before time zero, the multisine keeps its value of time zero.
Intention Hand::intention(double time_s) const noexcept {
  Intention result;
  result.position_W = start_W_;
  add_waypoints(time_s, result);
  add_trajectory(time_s, result);
  const double sine_time = time_s > 0.0 ? time_s : 0.0;
  for (const auto& sine : description_.multisine) {
    const double omega = 2.0 * M_PI * sine.frequency_Hz, angle = omega * sine_time + sine.phase_rad;
    const Vec3 way = sine.amplitude_m * Vec3(sine.direction.data());
    result.position_W += way * std::sin(angle);
    if (time_s > 0.0) result.velocity_W += way * (omega * std::cos(angle));
    const Vec3 turn = sine.amplitude_rad * Vec3(sine.direction.data());
    result.turn_W += turn * std::sin(angle);
    if (time_s > 0.0) result.turn_rate_W += turn * (omega * std::cos(angle));
  }
  return result;
}

namespace {
// Returns a number between −1 and 1 that is determined by both arguments and distributed uniformly. Method: the output
// function of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014), of which 53 bits
// are used.
double drawn(std::uint64_t seed, std::uint64_t number) noexcept {
  std::uint64_t z = (seed << 32) + (number + 1) * 0x9E3779B97F4A7C15U;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1.0;
}
}  // namespace

double Hand::variation(double time_s) const noexcept {
  const description::GripVariation& v = description_.variation;
  if (v.share <= 0.0 || time_s <= 0.0) return 1.0;
  const double intervals = time_s / v.interval_s, s = intervals - std::floor(intervals);
  const auto number = static_cast<std::uint64_t>(intervals);
  const double from = number == 0 ? 0.0 : drawn(v.seed, number - 1), to = drawn(v.seed, number);
  return 1.0 + v.share * (from + (to - from) * (s * s * s * (10.0 + s * (-15.0 + s * 6.0))));
}

description::Grip Hand::grip(double time_s) const noexcept {
  description::Grip held{0.0, description_.stiffness_N_per_m, description_.damping_Ns_per_m};
  for (const description::Grip& next : description_.grips) {
    if (time_s < next.time_s) break;
    const double share = std::min(1.0, (time_s - next.time_s) / description::grip_change_s);
    held.stiffness_N_per_m += share * (next.stiffness_N_per_m - held.stiffness_N_per_m);
    held.damping_Ns_per_m += share * (next.damping_Ns_per_m - held.damping_Ns_per_m);
  }
  const double factor = variation(time_s);
  held.stiffness_N_per_m *= factor;
  held.damping_Ns_per_m *= factor;
  return held;
}

Vec3 Hand::force_W(double time_s, const Vec3& position_W, const Vec3& velocity_W) const noexcept {
  const Intention want = intention(time_s);
  const description::Grip held = grip(time_s);
  Vec3 F =
      held.stiffness_N_per_m * (want.position_W - position_W) + held.damping_Ns_per_m * (want.velocity_W - velocity_W);
  if (!description_.force.empty()) F += data_force_W(time_s);
  const double length_N = F.norm();
  return length_N > description_.max_force_N ? Vec3(description_.max_force_N / length_N * F) : F;
}

Vec3 Hand::torque_W(double time_s, const models::Mat3& R_WT, const Vec3& angular_velocity_W) const noexcept {
  if (!description_.twists()) return Vec3::Zero();
  const Intention want = intention(time_s);
  const Eigen::AngleAxisd twist(models::rotation_by(want.turn_W).toRotationMatrix() * R_start_ * R_WT.transpose());
  const Vec3 torque = variation(time_s) * (description_.turning_stiffness_Nm_per_rad * twist.angle() * twist.axis() +
                                           description_.turning_damping_Nms_per_rad *
                                               (angular_velocity(want.turn_W, want.turn_rate_W) - angular_velocity_W));
  const double length_Nm = torque.norm();
  return length_Nm > description_.max_torque_Nm ? Vec3(description_.max_torque_Nm / length_Nm * torque) : torque;
}

}  // namespace proxarm::sim
