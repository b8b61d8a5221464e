#include "controller/setpoints/tool_guard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/limits/braking.hpp"

namespace proxarm::controller {

using models::ArmPoints;
using models::JointVector;
using models::Vec3;

namespace {

// Ten bisections find the setpoint to 2⁻¹⁰ of a step, 0.5 µm at 0.5 m/s and 1 ms.
constexpr int bisections = 10;
// Rounds of a fixed-point iteration: the gears' twist follows from the link angles, and the link angles follow from the
// twist. Each round divides the error by fifty. One round from the extrapolated twist leaves an error of at most 2e-8
// rad at usual accelerations; three rounds leave 1e-6 rad at the end of the longest braking distance.
constexpr int quick_rounds = 1, exact_rounds = 3;
// Shares of the speed limits that setpoints may use. Drives overshoot by up to 7 % when the guard acts, and the arm may
// exceed its limit by at most 5 %. The quick test is stricter than the exact test, which judges close cases.
constexpr double exact_share = 0.99, quick_share = 0.985, quick_way_m = 1e-4;
constexpr double touching_m = 1e-10;
// Tolerances of turning. turned_rad is for orientations, since setpoints are rounded to counts of some 1e-7 rad.
// turn_rounding_rad is for the turning in a period, which is as exact as the kinematics.
constexpr double turned_rad = 1e-6, turn_rounding_rad = 1e-9;
// Distance by which setpoints may be beyond a border. When the proxy's limits stop the tool at a border, gears twist,
// and setpoints go some micrometres beyond the border. With a smaller tolerance the guard would act together with the
// proxy's limits, and a hand would feel the border twice. With a larger tolerance the border would feel soft. It is a
// fifth of the promised 0.1 mm.
constexpr double twist_m = 2e-5;
// Largest correction for the motors' lead at borders, along each axis. most_lead_m and twist_m together are less than
// the promised 0.1 mm.
constexpr double most_lead_m = 6e-5;
// Distance by which the path between two points inside a border may go beyond the border: half of the promised 0.1 mm.
constexpr double bulge_m = 5e-5;
// Factor on a temporary speed limit of the tool. Motors with bent gears may exceed this limit for a moment: by a factor
// of up to 1.42 when an arm that is released in contact begins to move, and by a larger factor at order 2.
constexpr double slowed_share = 1.8;

double depth_in(const Vec3& p, const description::BoxDescription& box) noexcept {
  double depth = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    depth = std::min({depth, p[i] - box.min_m[k], box.max_m[k] - p[i]});
  }
  return depth;
}

// Returns how deep a setpoint may be in a keep-out box because of gear twist: twist_m, but at most a quarter of the
// box's thickness.
double twist_in(const description::BoxDescription& box) noexcept {
  double thinnest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) thinnest = std::min(thinnest, box.max_m[k] - box.min_m[k]);
  return std::min(twist_m, 0.25 * thinnest);
}

// Whether the segment enters the box, enlarged by `more`, by more than twist_in().
bool crosses(const Vec3& from, const Vec3& to, const description::BoxDescription& box, double more) noexcept {
  double enters = 0.0, leaves = 1.0;
  const double twist = twist_in(box);
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double low = box.min_m[k] - more + twist, high = box.max_m[k] + more - twist;
    const double way = to[i] - from[i];
    if (way == 0.0) {
      if (from[i] <= low || from[i] >= high) return false;
      continue;
    }
    const double a = (low - from[i]) / way, b = (high - from[i]) / way;
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return enters < leaves;
}

}  // namespace

ToolGuard::ToolGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                     const description::CellLimits& limits, double period_s)
    : arm_(&arm),
      lower_rad_(arm.lower_rad()),
      upper_rad_(arm.upper_rad()),
      acceleration_(JointVector::Zero(arm.axes())),
      curvature_(arm.path_curvature()),
      limits_(limits),
      has_borders_(!limits.keep_out.empty()),
      period_s_(period_s) {
  for (Eigen::Index i = 0; i < acceleration_.size(); ++i) {
    acceleration_[i] = drives[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    has_borders_ = has_borders_ || std::isfinite(limits.workspace_min_m[i]) || std::isfinite(limits.workspace_max_m[i]);
  }
  start(arm.start_rad());
}

void ToolGuard::start(const JointVector& target_rad) noexcept {
  target_rad_ = target_rad;
  speed_rad_per_s_ = JointVector::Zero(target_rad.size());
  points_.joint_W.fill(Vec3::Zero());  // an arm may have fewer joints, but all are archived
  arm_->points(arm_->link_from_motor(target_rad), points_);
  twist_k2_rad_ = points_.twist_rad;
  lead_W_.setZero();
}

ActiveLimits ToolGuard::step(const JointVector& wanted_rad, double max_speed_m_per_s, const Vec3* links_W,
                             const TurnSets* turn) noexcept {
  ActiveLimits active;
  // A lowered speed limit of the tool lowers the elbow's speed limit in proportion.
  const double share = std::min(1.0, slowed_share * max_speed_m_per_s / limits_.max_tool_speed_m_per_s);
  Limits limit{share * limits_.max_tool_speed_m_per_s, share * limits_.max_elbow_speed_m_per_s, turn};
  if (turn != nullptr) limit.from = orientation(target_rad_ - points_.twist_rad);
  ArmPoints at;
  evaluate(wanted_rad, quick_rounds, at);
  if (links_W != nullptr) lead_W_ = (at.tool_W - *links_W).cwiseMax(-most_lead_m).cwiseMin(most_lead_m);
  if (broken(wanted_rad, at, limit, Care::quick).kinds == 0) {
    accept(wanted_rad, at);
  } else {
    hold_back(wanted_rad, limit, active);
  }
  return active;
}

// Finds the arm's points at the setpoint theta. The iteration starts from the twist extrapolated from the last two
// periods.
void ToolGuard::evaluate(const JointVector& theta, int rounds, ArmPoints& out) const noexcept {
  JointVector twist = 2.0 * points_.twist_rad - twist_k2_rad_;
  for (int round = 0; round < rounds; ++round) {
    arm_->points(theta - twist, out);
    twist = out.twist_rad;
  }
}

double ToolGuard::stop_s(const JointVector& u) const noexcept {
  return u.cwiseAbs().cwiseQuotient(acceleration_).maxCoeff();
}

double ToolGuard::bend(const JointVector& d) const noexcept {
  const JointVector size = d.cwiseAbs();
  return size.dot(curvature_.lazyProduct(size));
}

// Returns the braking distance after a step, as a multiple of this step: the sum of 1 − kT/t for k from 1 to t/T.
double ToolGuard::braking_steps(double t) const noexcept {
  const double T = period_s_, steps = std::floor(t / T);
  return steps < 1.0 ? 0.0 : steps - 0.5 * steps * (steps + 1.0) * T / t;
}

ActiveLimits ToolGuard::broken(const JointVector& theta, const ArmPoints& at, const Limits& limit,
                               Care care) const noexcept {
  ActiveLimits out;
  const double T = period_s_;
  const JointVector u = (theta - target_rad_) / T;
  const double t = stop_s(u), curvature = bend(u);  // the path's second derivative in time, m/s²
  const double more_steps = braking_steps(t);
  judge_motion(at, t * curvature, limit, care, out);
  if (limit.turn != nullptr) judge_turning(theta, at, limit, more_steps, out);
  if (!has_borders_) return out;
  const double step_m = (at.tool_W - points_.tool_W).norm();
  const double way_m = fastest_to_rest(step_m / T, t * curvature) * t;
  if (far_from_borders(at.tool_W - lead_W_, step_m + way_m + quick_way_m)) return out;
  if (care == Care::quick) {
    out.set(Limit::guard_border);
    return out;
  }
  const JointVector way = more_steps * T * u;
  ArmPoints rest;
  evaluate(theta + way, exact_rounds, rest);
  judge_borders(at.tool_W, rest.tool_W, 0.125 * T * T * curvature, 0.125 * bend(way), out);
  return out;
}

void ToolGuard::judge_motion(const ArmPoints& at, double growth, const Limits& limit, Care care,
                             ActiveLimits& out) const noexcept {
  const double T = period_s_, share = care == Care::quick ? quick_share : exact_share;
  const auto judge = [&](const Vec3& step, double most_m_per_s, Limit kind) {
    if (fastest_to_rest(step.norm() / T, growth) > share * most_m_per_s) out.set(kind);
  };
  judge(at.tool_W - points_.tool_W, limit.tool_m_per_s, Limit::guard_speed);
  for (std::size_t i = first_joint; i < static_cast<std::size_t>(target_rad_.size()); ++i) {
    judge(at.joint_W[i] - points_.joint_W[i], limit.elbow_m_per_s, Limit::guard_elbow);
  }
}

Eigen::Quaterniond ToolGuard::orientation(const JointVector& link_rad) const noexcept {
  return Eigen::Quaterniond(arm_->tool_pose(link_rad).linear()).normalized();
}

// Judges turning in this step and on the way to rest. On this way the tool is assumed to approach a limit as fast as in
// this step, and the motors' lead vanishes. If the tool turns along a limit, straight braking in joint space takes the
// tool a few milliradians beyond the limit; this happens only in a stop.
void ToolGuard::judge_turning(const JointVector& theta, const ArmPoints& at, const Limits& limit, double more_steps,
                              ActiveLimits& out) const noexcept {
  const TurnSets& turn = *limit.turn;
  const Eigen::Quaterniond to = orientation(theta - at.twist_rad);
  const double before = turn.beyond_rad(limit.from), beyond = turn.beyond_rad(to);
  const double rest = beyond + more_steps * (beyond - before), most = std::max(0.0, before) + turned_rad;
  if (limit.from.angularDistance(to) > turn.max_speed_rad_per_s * period_s_ + turn_rounding_rad || beyond > most ||
      rest > most + TurnSets::lead_rad.most) {
    out.set(Limit::guard_turning);
  }
}

bool ToolGuard::far_from_borders(const Vec3& p, double way_m) const noexcept {
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (p[i] + way_m > limits_.workspace_max_m[k] || p[i] - way_m < limits_.workspace_min_m[k]) return false;
  }
  return std::all_of(limits_.keep_out.begin(), limits_.keep_out.end(),
                     [&](const description::BoxDescription& zone) { return depth_in(p, zone) < -way_m; });
}

void ToolGuard::judge_borders(const Vec3& at, const Vec3& rest, double step_bend, double rest_bend,
                              ActiveLimits& out) const noexcept {
  const Vec3 p_k1 = points_.tool_W - lead_W_, p = at - lead_W_, rest_p = rest - lead_W_;
  const double step_more = std::max(0.0, step_bend - bulge_m), rest_more = std::max(0.0, rest_bend - bulge_m);
  const double more = std::max(step_more, rest_more);
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double upper = std::max(limits_.workspace_max_m[k] + twist_m, p_k1[i]) + touching_m;
    const double lower = std::min(limits_.workspace_min_m[k] - twist_m, p_k1[i]) - touching_m;
    if (std::max(p[i], rest_p[i]) + more > upper || std::min(p[i], rest_p[i]) - more < lower) {
      out.set(Limit::guard_border);
    }
  }
  for (const description::BoxDescription& zone : limits_.keep_out) {
    const double depth = depth_in(p_k1, zone);
    if (depth > twist_in(zone)) {
      if (std::max(depth_in(p, zone), depth_in(rest_p, zone)) > depth + touching_m) out.set(Limit::guard_border);
    } else if (crosses(p_k1, p, zone, step_more) || crosses(p, rest_p, zone, rest_more)) {
      out.set(Limit::guard_border);
    }
  }
}

// Returns theta, limited to setpoints from which each joint can stop before the end of its range. When all joints brake
// together, a single joint may brake too weakly for this.
JointVector ToolGuard::within_ranges(JointVector theta) const noexcept {
  const double T = period_s_;
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const double low = T * approach_speed(target_rad_[i] - lower_rad_[i], acceleration_[i], T);
    const double high = T * approach_speed(upper_rad_[i] - target_rad_[i], acceleration_[i], T);
    theta[i] = std::clamp(theta[i], target_rad_[i] - low, target_rad_[i] + high);
  }
  return theta;
}

void ToolGuard::hold_back(const JointVector& wanted, const Limits& limit, ActiveLimits& out) noexcept {
  ++judged_exactly_;
  ArmPoints at;
  evaluate(target_rad_, exact_rounds, at);
  points_.tool_W = at.tool_W;
  points_.joint_W = at.joint_W;
  evaluate(wanted, exact_rounds, at);
  out = broken(wanted, at, limit, Care::exact);
  if (out.kinds == 0) return accept(wanted, at);
  const double T = period_s_, t = stop_s(speed_rad_per_s_);
  const JointVector slower = t > T ? JointVector(target_rad_ + (1.0 - T / t) * T * speed_rad_per_s_) : target_rad_;
  const JointVector brakes = within_ranges(slower);
  JointVector best = brakes;
  ArmPoints best_at;
  evaluate(brakes, exact_rounds, best_at);
  double kept = 0.0, broke = 1.0;
  for (int i = 0; i < bisections; ++i) {
    const double share = 0.5 * (kept + broke);
    const JointVector theta = brakes + share * (wanted - brakes);
    evaluate(theta, exact_rounds, at);
    if (broken(theta, at, limit, Care::exact).kinds != 0) {
      broke = share;
      continue;
    }
    kept = share;
    best = theta;
    best_at = at;
  }
  accept(best, best_at);
}

void ToolGuard::accept(const JointVector& theta, const ArmPoints& at) noexcept {
  speed_rad_per_s_ = (theta - target_rad_) / period_s_;
  target_rad_ = theta;
  twist_k2_rad_ = points_.twist_rad;
  points_ = at;
}

void ToolGuard::archive(fieldbus::StateArchive& state) noexcept {
  state(target_rad_, speed_rad_per_s_, twist_k2_rad_, points_.twist_rad, points_.tool_W);
  for (Vec3& joint_W : points_.joint_W) state(joint_W);
  state(lead_W_);
}

}  // namespace proxarm::controller
