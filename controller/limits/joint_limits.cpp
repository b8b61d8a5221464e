#include "controller/limits/joint_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/arm/held_orientation.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

// The share of a joint's speed that the tool's translation may use; the rest is for its rotation and the gears' twist.
constexpr double speed_share = 0.95;
// Nearer to a singularity, joints' limits do act. Besides, σ₀ is exact to some (σ_max/σ₀)² ε, which is 1e-11 here.
constexpr double least_m_per_rad = 0.01;
// The bound is used up to this share of σ₀, where it is 4/σ₀ above ‖g_i(q₀)‖.
constexpr double farthest = 0.5;
// It is computed anew where that would tell more: beyond this share.
constexpr double worth_it = 1.0 / 16.0;
// Rounding of the bound, relatively; far above that of some dozen operations and of σ₀.
constexpr double rounding = 1e-9;

}  // namespace

JointLimits::JointLimits(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                         double period_s)
    : weights_(JointVector::Zero(arm.axes())),
      bounded_(arm.axes() >= 6),
      from_rad_(JointVector::Zero(arm.axes())),
      rows_(JointVector::Zero(arm.axes())) {
  const models::JointMatrix C = arm.path_curvature();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const description::DriveDescription& drive = drives[static_cast<std::size_t>(i)];
    joints_.push_back({drive.range_rad[0], drive.range_rad[1], drive.max_speed_rad_per_s,
                       drive.max_acceleration_rad_per_s2, 0.0, 0.0});
    bounded_ = bounded_ && !arm.slides(static_cast<int>(i));
    const double l = models::turning_length_m;
    weights_[i] = std::sqrt(C.row(i).squaredNorm() + static_cast<double>(weights_.size()) * l * l);
  }
  set_period(period_s);
}

void JointLimits::set_period(double period_s) noexcept {
  const double T = period_s;
  share_ = 0.0;
  for (Joint& joint : joints_) {
    joint.per_step_rad = speed_share * joint.speed_rad_per_s * T;
    joint.share = T / (T + joint.speed_rad_per_s / joint.acceleration_rad_per_s2);
    share_ = std::max(share_, joint.share);
  }
}

void JointLimits::begin(const JointVector& joint_rad, const JointVector& twist_rad,
                        const models::Jacobian& J_W) noexcept {
  joint_rad_ = joint_rad;
  twist_rad_ = twist_rad;
  J_W_ = &J_W;
  made_ = false;
  clear_m_ = clear_m();
}

double JointLimits::room_rad(std::size_t i, double sign) const noexcept {
  const auto k = static_cast<Eigen::Index>(i);
  const double to_end = sign > 0.0 ? joints_[i].upper_rad - joint_rad_[k] - std::max(0.0, twist_rad_[k])
                                   : joint_rad_[k] - joints_[i].lower_rad - std::max(0.0, -twist_rad_[k]);
  return std::max(0.0, joints_[i].share * to_end);
}

// e of the header.
double JointLimits::bent() const noexcept { return weights_.dot((joint_rad_ - from_rad_).cwiseAbs()); }

// The radius of the ball that no half-space reaches into; below zero if it isn't known.
double JointLimits::clear_m() const noexcept {
  const double e = bent();
  if (!(e <= farthest * least_) || !(least_ > 0.0)) return -1.0;
  const double more = 2.0 * e / (least_ * (least_ - e));
  double clear_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const double room = std::min({room_rad(i, 1.0), room_rad(i, -1.0), joints_[i].per_step_rad});
    clear_m = std::min(clear_m, room / (rows_[static_cast<Eigen::Index>(i)] + more));
  }
  return (1.0 - rounding) * clear_m;
}

std::span<const LimitPlane<3>> JointLimits::planes() noexcept {
  if (made_) return {planes_.data(), count_};
  made_ = true;
  count_ = 0;
  ++counts_.made;
  const models::SmallColumns3 G = models::joints_per_m(*J_W_);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Vec3 row = G.row(static_cast<Eigen::Index>(i));
    const double length = row.norm();
    if (!(length > 1e-9)) continue;
    const auto bit = static_cast<std::uint8_t>(1u << i);
    for (const double sign : {1.0, -1.0}) {
      const double room = room_rad(i, sign);
      const bool range = room < joints_[i].per_step_rad;
      planes_[count_++] = {sign / length * row, std::min(room, joints_[i].per_step_rad) / length,
                           range ? Limit::joint_range : Limit::joint_speed, bit, range ? joints_[i].share : 0.0};
    }
  }
  if (bounded_ && !(bent() <= worth_it * least_)) bound_from_here(G);
  return {planes_.data(), count_};
}

void JointLimits::bound_from_here(const models::SmallColumns3& G) noexcept {
  ++counts_.bounds;
  from_rad_ = joint_rad_;
  rows_ = G.rowwise().norm();
  least_ = models::least_singular_value(*J_W_);
  if (!(least_ >= least_m_per_rad)) least_ = 0.0;
}

}  // namespace proxarm::controller
