#include "controller/arm_step/arm_step.hpp"

#include <algorithm>
#include <cmath>

#include "controller/limits/braking.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

using models::JointMatrix;
using models::JointVector;
using models::Mat3;
using models::Vec3;

namespace {

// Share of a joint's maximum speed that the proxy's step may use; the rest is for the gears' twist.
constexpr double speed_share = 0.95;
// Shares of a joint's maximum acceleration: behind the filter (acceleration_share), for braking (braking_share), and
// behind the filter in a reduced box (eased_share).
constexpr double acceleration_share = 1.0, braking_share = 0.5, eased_share = 0.9;
// Share of the elbow's speed limit that a step may use. Gears add some 7 % when a hand pulls the arm along at the
// limit.
constexpr double elbow_share = 0.9;
// Cost of a joint's step, added to the cost of turning: (joint speed / speed limit)² counts as joint_cost (rad/s)².
// This cost damps turning near a wrist singularity, below a singular value of 0.03 rad/rad.
constexpr double joint_cost = 1e-3;
// Arms with fewer than six axes turn the tool as little as possible: 1 rad of turning costs as much as 10 rad of a
// joint, as in prioritized_step.hpp.
constexpr double few_axes_turning = 100.0;
// Factor on the costs of turning and joint steps in the search for the nearest place, in m²/rad². With a turning lag of
// a milliradian the found place is off by 1e-10 m.
constexpr double beside_place = 1e-7;
// A place counts as reached within this distance, a tenth of the encoders' resolution at a metre.
constexpr double reached_m = 1e-9;
constexpr double place_tolerance_m = 1e-12;
// A step that is outside a curved set by less than this, in m or rad, counts as inside. It is 1 µm/s at 1 ms.
constexpr double set_tolerance = 1e-9;
// Lower bound of braking_s(), the time with which the borders of turning and place are approached. braking_s() is the
// longest braking time from any speed: with the braking time from the present speed, joints that get faster would pass
// the border.
constexpr double approach_s = 0.1;
// If the tool lags behind a held orientation, its turning accelerates at catching_rad_per_s2, up to catching_share of
// the turning speed limit, and ends with the time constant catching_s. The end of a handle, 0.1 m from T, then
// accelerates at 0.5 m/s².
constexpr double catching_s = 0.1, catching_rad_per_s2 = 5.0, catching_share = 0.25;
// Largest lag that one step may close; 1 µm at a metre.
constexpr double caught_up_rad = 1e-6;
// Allowed change of a joint's step, in halves of its acceleration. first_ease is tried first; each next trial
// multiplies the change by next_ease. From whole_box on, U's whole box is used.
constexpr double first_ease = 1.0, next_ease = 4.0, whole_box = 256.0;
// The wrist counts as nearly singular if the sine of its middle angle is smaller than this.
constexpr double near_singular = 0.3;
constexpr int most_rounds = 8;
constexpr int bisections = 8;  // between braking and a step; the result is exact to 0.4 % of the distance between them
// A step may leave the sets of turning by this share of the angle by which braking leaves them.
constexpr double coming_back = 0.1;
constexpr double alike = 1e-3;  // two half-spaces are alike if the sine between their normals is smaller
constexpr double rounding_rad = 1e-12;
constexpr std::size_t first_point = 2;  // the first joint whose place has a speed limit; the first two hardly move

// Inverse of fastest_to_rest(): returns the highest speed at the beginning of braking with which the point's speed
// stays below `most`.
double fastest_start(double B, double most) noexcept {
  return B <= most ? most : std::max(0.0, 2.0 * std::sqrt(B * most) - B);
}

}  // namespace

ArmStep::ArmStep(const models::Arm& arm, const models::InverseKinematics& inverse,
                 const std::vector<description::DriveDescription>& drives, double period_s)
    : arm_(&arm),
      inverse_(&inverse),
      curvature_(arm.path_curvature()),
      cost_(arm.axes()),
      margin_(arm, inverse.space()),
      brakes_s_(braking_s(drives)) {
  for (Eigen::Index i = 0; i < cost_.size(); ++i) {
    const description::DriveDescription& drive = drives[static_cast<std::size_t>(i)];
    joints_.push_back({drive.range_rad[0], drive.range_rad[1], drive.max_speed_rad_per_s,
                       drive.max_acceleration_rad_per_s2, 0.0, 0.0});
    cost_[i] = joint_cost / (drive.max_speed_rad_per_s * drive.max_speed_rad_per_s);
  }
  set_period(period_s);
  start(arm.start_rad());
}

double ArmStep::braking_s(const std::vector<description::DriveDescription>& drives) noexcept {
  double longest_s = approach_s;
  for (const description::DriveDescription& drive : drives) {
    const double deceleration = braking_share * drive.max_acceleration_rad_per_s2;
    longest_s = std::max(longest_s, speed_share * drive.max_speed_rad_per_s / deceleration);
  }
  return longest_s;
}

void ArmStep::set_period(double period_s) noexcept {
  period_s_ = period_s;
  for (Joint& joint : joints_) {
    joint.per_step_rad = speed_share * joint.speed_rad_per_s * period_s;
    joint.share = period_s / (period_s + joint.speed_rad_per_s / joint.acceleration_rad_per_s2);
  }
}

void ArmStep::start(const JointVector& link_rad) noexcept { resume(link_rad, JointVector::Zero(link_rad.size())); }

void ArmStep::resume(const JointVector& link_rad, const JointVector& step_rad) noexcept {
  link_rad_ = link_rad;
  step_rad_ = step_rad;
  lags_ = false;
  solution_.q = link_rad;
  arm_->kinematics(link_rad, solution_.kinematics);
}

Eigen::Quaterniond ArmStep::R_WT() const noexcept {
  return Eigen::Quaterniond(solution_.kinematics.X_WT.linear()).normalized();
}

// ---- the sets

void ArmStep::begin(const ArmStepStart& start) noexcept {
  start_ = start;
  active_ = {};
  asked_ = linearised_ = false;
  row_count_ = 0;
  from_ = solution_.kinematics;
  aim(start.R_WT);
  margin_.go_to(link_rad_, from_);
  make_boxes(start);
  eases_ = eases();
  use_first_box();
  if (start.held && eases_) turn_gently();
}

// Sets the orientation that this step shall reach. If the tool lags behind a held orientation, it is one on the way to
// R_WT, so that the tool's turning accelerates no faster than joints can, and slows down towards R_WT.
void ArmStep::aim(const Eigen::Quaterniond& R_WT) noexcept {
  start_.R_WT = aim_ = R_WT;
  asked_ = catches_up_ = false;
  if (!lags_ || !start_.held) {
    catching_rad_per_s_ = 0.0;
    return;
  }
  const Eigen::Quaterniond here = Eigen::Quaterniond(from_.X_WT.linear()).normalized();
  const Vec3 lag = models::rotation_vector(R_WT * here.conjugate());
  const double angle = lag.norm(), T = period_s_;
  if (!(angle > caught_up_rad)) return;
  catches_up_ = true;
  catching_rad_per_s_ = std::min({catching_rad_per_s_ + catching_rad_per_s2 * T, angle / catching_s,
                                  catching_share * start_.turn.max_speed_rad_per_s});
  aim_ = (models::rotation_by(std::min(1.0, T * catching_rad_per_s_ / angle) * lag) * here).normalized();
}

double ArmStep::room_rad(std::size_t i, double sign) const noexcept {
  const auto k = static_cast<Eigen::Index>(i);
  const double to_end = sign > 0.0 ? joints_[i].upper_rad - link_rad_[k] - std::max(0.0, start_.twist_rad[k])
                                   : link_rad_[k] - joints_[i].lower_rad - std::max(0.0, -start_.twist_rad[k]);
  return std::max(0.0, joints_[i].share * to_end);
}

// Makes the braking step and U's whole box. Ranges and speeds bound every step; accelerations bound only steps that
// don't brake.
void ArmStep::make_boxes(const ArmStepStart& start) noexcept {
  const double T = period_s_;
  double cycles = 0.0;  // longest braking time of a joint
  for (Eigen::Index i = 0; i < step_rad_.size(); ++i) {
    const double a = joints_[static_cast<std::size_t>(i)].acceleration_rad_per_s2;
    cycles = std::max(cycles, std::abs(step_rad_[i]) / (braking_share * a * T * T));
  }
  start_.turn.brakes_s = brakes_s_;
  brakes_ = cycles > 1.0 ? JointVector((1.0 - 1.0 / cycles) * step_rad_) : JointVector::Zero(step_rad_.size());
  whole_ = box_ = {brakes_, brakes_};
  for (Eigen::Index i = 0; i < brakes_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Joint& joint = joints_[k];
    const double low = -std::min(joint.per_step_rad, room_rad(k, -1.0));
    const double high = std::min(joint.per_step_rad, room_rad(k, 1.0));
    const double coasts = start.coasting_rad[i] - link_rad_[i];
    const double change = acceleration_share * joint.acceleration_rad_per_s2 * start.input_s2;
    brakes_[i] = std::clamp(brakes_[i], low, high);
    whole_.low[i] = std::clamp(coasts - change, low, brakes_[i]);
    whole_.high[i] = std::clamp(coasts + change, brakes_[i], high);
  }
}

// Returns the hardest braking along the last step that U's box allows. It often stops at once, since the filter then
// brakes the setpoints.
JointVector ArmStep::hardest_braking() const noexcept {
  double share = 0.0;
  for (Eigen::Index i = 0; i < step_rad_.size(); ++i) {
    const double u = step_rad_[i], least = u > 0.0 ? whole_.low[i] : whole_.high[i];
    if (u != 0.0) share = std::max(share, least / u);
  }
  return (std::min(1.0, share) * step_rad_).cwiseMax(whole_.low).cwiseMin(whole_.high);
}

// Whether a reduced box is tried first. If a hand turns a point tool, the box makes turning change only as fast as
// joints can. The box is equally large for steps that reach this limit and for steps that leave it: with a smaller box
// for leaving, the tool oscillated between the two boxes at 16 Hz.
bool ArmStep::eases() const noexcept {
  return lags_ || (start_.held ? near_wrist_singularity() : !start_.touches_turning);
}

void ArmStep::use_first_box() noexcept { use_box(eases_ ? first_ease : whole_box); }

// Keeps joints that only turn the tool in the reduced box, even where the place needs more. Only for a held
// orientation: if a hand turns the tool, these joints may have to stop at once.
void ArmStep::turn_gently() noexcept {
  for (Eigen::Index i = 0; i < brakes_.size(); ++i) {
    if (margin_.carries(i)) continue;
    whole_.low[i] = box_.low[i];
    whole_.high[i] = box_.high[i];
  }
}

bool ArmStep::near_wrist_singularity() const noexcept {
  const Eigen::Index n = from_.J_W.cols();
  if (!inverse_->reaches_orientation() || n < 6) return false;
  const auto axis = [&](Eigen::Index i) {
    return Vec3(from_.J_W.col(arm_->drive_along_chain(static_cast<std::size_t>(n - i))).tail<3>());
  };
  return std::abs(axis(1).cross(axis(2)).dot(axis(3))) < near_singular;
}

// Puts the part of U's box in use in which no joint's step changes by more than `ease` times half of the joint's
// acceleration.
void ArmStep::use_box(double ease) noexcept {
  ease_ = ease;
  if (!(ease < whole_box)) {
    box_ = whole_;
    return;
  }
  for (Eigen::Index i = 0; i < brakes_.size(); ++i) {
    const double a = joints_[static_cast<std::size_t>(i)].acceleration_rad_per_s2;
    const double change = ease * braking_share * a * period_s_ * period_s_;
    const double coasts = start_.coasting_rad[i] - link_rad_[i], filtered = eased_share * a * start_.input_s2;
    const double low = std::max(step_rad_[i] - change, coasts - filtered);
    const double high = std::min(step_rad_[i] + change, coasts + filtered);
    box_.low[i] = std::clamp(low, whole_.low[i], brakes_[i]);
    box_.high[i] = std::clamp(high, brakes_[i], whole_.high[i]);
  }
}

bool ArmStep::Box::contains(const JointVector& u) const noexcept {
  return (u.array() >= low.array() - rounding_rad).all() && (u.array() <= high.array() + rounding_rad).all();
}

// Returns the allowed decrease of σ in this step: a share of σ's distance from its border, but at least the smallest
// decrease that the joints can make.
double ArmStep::place_bound(const PlaceMargin::Border& border) const noexcept {
  const double share = period_s_ / (period_s_ + brakes_s_);
  return std::max(std::max(0.0, share * (border.value - margin_.least())), least(-border.gradient));
}

// Whether U contains u, the step to the solution of the inverse kinematics.
bool ArmStep::allows(const JointVector& u) const noexcept {
  if (!box_.contains(u)) return false;
  for (const PlaceMargin::Border& border : margin_.near()) {
    if (-border.gradient.dot(u) > place_bound(border) + rounding_rad) return false;
  }
  return !points_too_fast(u, &solution_.kinematics);
}

// Returns B = t |u̇|ᵀC|u̇|, where t is the braking time. While all joints brake together to rest, the speed of a point
// is at most V, its speed when braking begins, if B ≤ V, and at most (V + B)²/4B otherwise (derived in tool_guard.hpp).
double ArmStep::growth_m_per_s(const JointVector& u) const noexcept {
  const JointVector rate = u.cwiseAbs() / period_s_;
  return braking_of(slowest_to_brake(rate), rate) * rate.dot(curvature_.lazyProduct(rate));
}

// Returns the gradient of growth_m_per_s() by u, m/s per rad.
JointVector ArmStep::growth_gradient(const JointVector& u) const noexcept {
  const JointVector rate = u.cwiseAbs() / period_s_, bent = curvature_ * rate;
  const Eigen::Index slowest = slowest_to_brake(rate);
  JointVector out = 2.0 * braking_of(slowest, rate) * bent;
  out[slowest] += rate.dot(bent) / joints_[static_cast<std::size_t>(slowest)].acceleration_rad_per_s2;
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = std::copysign(out[i] / period_s_, u[i]);
  return out;
}

// Returns the braking time of joint i.
double ArmStep::braking_of(Eigen::Index i, const JointVector& rad_per_s) const noexcept {
  return rad_per_s[i] / joints_[static_cast<std::size_t>(i)].acceleration_rad_per_s2;
}

// Returns the joint with the longest braking time.
Eigen::Index ArmStep::slowest_to_brake(const JointVector& rad_per_s) const noexcept {
  Eigen::Index slowest = 0;
  for (Eigen::Index i = 1; i < rad_per_s.size(); ++i) {
    if (braking_of(i, rad_per_s) > braking_of(slowest, rad_per_s)) slowest = i;
  }
  return slowest;
}

// Whether T, elbow or wrist get too fast in the step u or while braking after it. `known`: kinematics after the step,
// or null. Most steps need no kinematics: a point moves by at most Σ R_i |u_i|, where R_i is the largest distance of T
// from axis i.
bool ArmStep::points_too_fast(const JointVector& u, const models::ToolKinematics* known) const noexcept {
  const double B = growth_m_per_s(u), T = period_s_;
  const double tool_m_per_s = elbow_share * start_.tool_m_per_s, elbow_m_per_s = elbow_share * start_.elbow_m_per_s;
  const double tool_m = T * fastest_start(B, tool_m_per_s), elbow_m = T * fastest_start(B, elbow_m_per_s);
  if (curvature_.diagonal().dot(u.cwiseAbs()) <= std::min(tool_m, elbow_m)) return false;
  models::ToolKinematics after;
  if (known == nullptr) arm_->kinematics(link_rad_ + u, after);
  const models::ToolKinematics& to = known != nullptr ? *known : after;
  // If braking makes T no faster, the ball of the speed limit bounds T's speed (step_limits.hpp).
  if (B > tool_m_per_s && (to.X_WT.translation() - from_.X_WT.translation()).norm() > tool_m + set_tolerance) {
    return true;
  }
  for (auto k = first_point; k < static_cast<std::size_t>(u.size()); ++k) {
    if ((to.joint_W[k] - from_.joint_W[k]).norm() > elbow_m + set_tolerance) return true;
  }
  return false;
}

// ---- queries of the proxy

bool ArmStep::contains(const Vec3& q_W) noexcept {
  models::Pose X_WT = models::Pose::Identity();
  X_WT.translation() = q_W;
  X_WT.linear() = aim_.toRotationMatrix();
  if (asked_) solution_.kinematics = from_;
  use_first_box();
  inverse_->solve(link_rad_, X_WT, solution_);
  asked_W_ = q_W;
  asked_ = true;
  allowed_ = solution_.status == models::InverseKinematicsResult::Status::converged && allows(solution_.q - link_rad_);
  return allowed_;
}

bool ArmStep::cut(const Vec3& q_W, const Vec3& q_k1_W, LimitPlane<3>& out) noexcept {
  if (!linearised_) start_model();
  use_box(whole_box);
  // A step u with J_w u = `wanted` carries the wrist to its place for a tool at q_W.
  const Vec3 here_W = model_.at.X_WT.translation() + wrist_.from_T_W;
  const auto wanted_for = [&](const Vec3& from_T_W) { return q_W + from_T_W - here_W + wrist_.J_W * model_.u; };
  Vec3 wanted = wanted_for(wrist_wanted_W_) - wrist_.by_turning_W * turn_from(model_, aim_);
  if (can_carry_wrist(wanted)) return false;
  if (!start_.held) {
    wanted = wanted_for(wrist_.from_T_W);
    if (can_carry_wrist(wanted)) return false;
  }
  solve_near(model_, wrist_.J_W, wanted);
  const Vec3 beyond = wanted - wrist_.J_W * program_.u();
  const double length = beyond.norm();
  if (!(length > reached_m)) return false;
  out.limits = pressing();
  out.normal = beyond / length;
  out.bound_m = out.normal.dot(q_W - q_k1_W) - length;
  out.share = 0.0;
  return true;
}

bool ArmStep::can_carry_wrist(const Vec3& wanted) noexcept {
  for (int round = 0; round < most_rounds && solve_at(model_, wrist_.J_W, wanted); ++round) {
    if (!leave_curved_sets(model_, program_.u())) return true;
  }
  return false;
}

// ---- the quadratic programs

void ArmStep::linearise(const JointVector& u, Model& model) const noexcept {
  model.u = u;
  arm_->kinematics(link_rad_ + u, model.at);
}

void ArmStep::start_model() noexcept {
  linearise(brakes_, model_);
  wrist_ = margin_.wrist(model_.at);
  wrist_wanted_W_ = aim_ * (model_.at.X_WT.linear().transpose() * wrist_.from_T_W);
  linearised_ = true;
}

// Returns the rotation vector from the model's orientation to R.
Vec3 ArmStep::turn_from(const Model& model, const Eigen::Quaterniond& R) const noexcept {
  const Eigen::Quaterniond here = Eigen::Quaterniond(model.at.X_WT.linear()).normalized();
  return models::rotation_vector(R * here.conjugate());
}

// Sets H and g of the objective ½ w |J_R (u' − u) − e_R|² + ½ Σ c_i (u'_i − u_b,i)². e_R: rotation vector to aim_.
void ArmStep::objective(const Model& model, JointMatrix& H, JointVector& g) const noexcept {
  const auto J_R = model.at.J_W.bottomRows<3>();
  const double w = inverse_->reaches_orientation() ? 1.0 : few_axes_turning;
  const JointVector cost = inverse_->reaches_orientation() ? cost_ : JointVector::Ones(cost_.size());
  const Vec3 wanted = turn_from(model, aim_) + J_R * model.u;
  H = w * J_R.transpose() * J_R;
  H.diagonal() += cost;
  g = w * (J_R.transpose() * wanted) + cost.cwiseProduct(brakes_);
}

void ArmStep::add_set(const JointVector& a, double b, Limit limit) noexcept {
  const std::size_t row = program_.rows();
  program_.at_most(a, b);
  if (program_.rows() == row) return;
  kind_[row] = limit;
}

void ArmStep::add_sets() noexcept {
  first_set_ = program_.rows();
  program_.within(box_.low, box_.high);
  box_rows_ = program_.rows() - first_set_;
  for (const PlaceMargin::Border& border : margin_.near()) {
    add_set(-border.gradient, place_bound(border), Limit::singularity);
  }
  for (std::size_t k = 0; k < row_count_; ++k) add_set(rows_[k].a, rows_[k].b, rows_[k].limit);
}

// Returns the minimum of a·u in U's box.
double ArmStep::least(const JointVector& a) const noexcept {
  return (a.array() * (a.array() > 0.0).select(whole_.low, whole_.high).array()).sum();
}

// Adds the half-space a·u ≤ b, widened to what the joints can still do. Returns whether the widened half-space excludes
// `step`. It may contain `step` if every step of the joints leaves a·u ≤ b, braking included, or if `step` leaves the
// curved set only by the curvature of its border.
bool ArmStep::add_row(const JointVector& a, double b, Limit limit, const JointVector& step) noexcept {
  const Row row{a, std::max(b, least(a)), limit};
  if (a.dot(step) <= row.b + set_tolerance) return false;
  // A nearly parallel row is replaced, since two nearly parallel rows would cost the program's result digits.
  for (std::size_t k = 0; k < row_count_; ++k) {
    if (rows_[k].limit != limit || (rows_[k].a - a).norm() > alike * a.norm()) continue;
    rows_[k] = row;
    return true;
  }
  rows_[row_count_ < rows_.size() ? row_count_++ : slackest_row(step)] = row;
  return true;
}

// Returns the half-space whose border is furthest from this step.
std::size_t ArmStep::slackest_row(const JointVector& step) const noexcept {
  std::size_t slackest = 0;
  double most = 0.0;
  for (std::size_t k = 0; k < row_count_; ++k) {
    const double slack = (rows_[k].b - rows_[k].a.dot(step)) / rows_[k].a.norm();
    if (slack > most) {
      most = slack;
      slackest = k;
    }
  }
  return slackest;
}

// Finds the step in U with J u = `wanted` that turns the tool as near to its orientation aim_ as U allows. Returns
// false if U contains no step with J u = `wanted`.
bool ArmStep::solve_at(const Model& model, const Rows& J, const Vec3& wanted) noexcept {
  JointMatrix H;
  JointVector g;
  objective(model, H, g);
  ++programs_;
  program_.start(H, g);
  const models::ToolSpace& space = inverse_->space();
  for (int k = 0; k < space.dimensions; ++k) {
    const Vec3 e = space.axes.col(k);
    program_.equal(J.transpose() * e, e.dot(wanted));
  }
  add_sets();
  return program_.solve();
}

// Finds the step in U whose J u is nearest to `wanted`.
bool ArmStep::solve_near(const Model& model, const Rows& J, const Vec3& wanted) noexcept {
  JointMatrix H;
  JointVector g;
  objective(model, H, g);
  ++programs_;
  program_.start(J.transpose() * J + beside_place * H, J.transpose() * wanted + beside_place * g);
  add_sets();
  return program_.solve();
}

// Returns the rotation vector by which u turns the tool beyond the sets of turning.
Vec3 ArmStep::turned_beyond(const Model& model, const JointVector& u) const noexcept {
  if (!inverse_->reaches_orientation()) return Vec3::Zero();
  const auto J_R = model.at.J_W.bottomRows<3>();
  const Eigen::Quaterniond from = Eigen::Quaterniond(from_.X_WT.linear()).normalized();
  const Eigen::Quaterniond to =
      (models::rotation_by(J_R * (u - model.u)) * Eigen::Quaterniond(model.at.X_WT.linear())).normalized();
  Eigen::Quaterniond within = to;
  start_.turn.keep(from, within);
  return models::rotation_vector(to * within.conjugate());
}

// Adds half-spaces for the curved sets that u leaves. Returns whether an added half-space excludes u.
bool ArmStep::leave_curved_sets(const Model& model, const JointVector& u) noexcept {
  bool leaves = false;
  const Vec3 beyond = turned_beyond(model, u);
  if (const double angle = beyond.norm(); angle > set_tolerance) {
    const auto J_R = model.at.J_W.bottomRows<3>();
    const Vec3 n = beyond / angle;
    leaves = add_row(J_R.transpose() * n, n.dot(J_R * u) - angle, Limit{}, u);
  }
  return (points_too_fast(u, nullptr) && limit_points(model, u)) || leaves;
}

// Returns a step between braking and u that leaves no curved set. Reason: a solution with half-spaces may still leave a
// curved set a little, since half-spaces approach the set in ever smaller steps; braking leaves no set that the joints
// can keep. If braking leaves the sets of turning, a step that almost returns into them is accepted: otherwise a tool
// slightly beyond its limit would stay there.
JointVector ArmStep::taken_back(const Model& model, const JointVector& u) const noexcept {
  const double most = std::max(set_tolerance, coming_back * turned_beyond(model, brakes_).norm());
  const auto leaves = [&](const JointVector& tried) {
    return turned_beyond(model, tried).norm() > most || points_too_fast(tried, nullptr);
  };
  if (!leaves(u)) return u;
  double kept = 0.0, left = 1.0;
  for (int i = 0; i < bisections; ++i) {
    const double share = 0.5 * (kept + left);
    (leaves(brakes_ + share * (u - brakes_)) ? left : kept) = share;
  }
  return brakes_ + kept * (u - brakes_);
}

// Adds half-spaces for the points that get too fast in the step u or while braking after it. Returns whether an added
// half-space excludes u. If B > V, a half-space bounds (V + B)²/4B, linearised at u, since B changes with u:
//   ∂/∂V = (V + B)/2B,   ∂/∂B = (B² − V²)/4B²,   ∂B/∂u̇ = 2t C|u̇| sgn u̇ + |u̇|ᵀC|u̇| ∂t/∂u̇
bool ArmStep::limit_points(const Model& model, const JointVector& u) noexcept {
  models::ToolKinematics at;
  arm_->kinematics(link_rad_ + u, at);
  const auto axes = static_cast<std::size_t>(u.size());
  const double B = growth_m_per_s(u), T = period_s_;
  const JointVector B_u = growth_gradient(u);
  bool leaves = false;
  // Only the joints before a joint move its origin.
  const auto limit = [&](const Vec3& from_W, const Vec3& to_W, std::size_t joints, double most_m_per_s) {
    const Vec3 way = to_W - from_W;
    const double length = way.norm(), V = length / T, beyond = fastest_to_rest(V, B) - most_m_per_s;
    if (!(beyond > 0.0)) return;
    JointVector a(u.size());
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      const Vec3 turning = model.at.J_W.col(i).tail<3>();
      a[i] = way.dot(model.at.J_W.col(i).head<3>() + turning.cross(to_W - at.X_WT.translation())) / length;
    }
    for (std::size_t j = joints; j < axes; ++j) a[arm_->drive_along_chain(j)] = 0.0;
    if (B > V) a = (V + B) / (2.0 * B) * a + T * (B * B - V * V) / (4.0 * B * B) * B_u;
    leaves = add_row(a, a.dot(u) - T * beyond, Limit::speed, u) || leaves;
  };
  limit(from_.X_WT.translation(), at.X_WT.translation(), axes, elbow_share * start_.tool_m_per_s);
  for (std::size_t k = first_point; k < axes; ++k) {
    limit(from_.joint_W[k], at.joint_W[k], k, elbow_share * start_.elbow_m_per_s);
  }
  return leaves;
}

void ArmStep::note_joint(std::size_t i, double sign, ActiveLimits& out) const noexcept {
  const auto k = static_cast<Eigen::Index>(i);
  const double at = sign > 0.0 ? box_.high[k] : -box_.low[k];
  const auto bit = static_cast<std::uint8_t>(1u << i);
  if (at >= joints_[i].per_step_rad) return out.set(Limit::joint_speed, bit);
  if (at >= room_rad(i, sign)) return out.set(Limit::joint_range, bit);
  out.set(Limit::joint_acceleration, bit);
}

ActiveLimits ArmStep::pressing() const noexcept {
  ActiveLimits out;
  for (std::size_t row = first_set_; row < program_.rows(); ++row) {
    if (!(program_.multiplier(row) > 0.0)) continue;
    const std::size_t k = row - first_set_;
    if (k >= box_rows_) {
      out.set(kind_[row]);
    } else {
      note_joint(k / 2, k % 2 == 0 ? 1.0 : -1.0, out);
    }
  }
  return out;
}

// ---- the step

ArmStep::Outcome ArmStep::go(const Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept {
  if (!q_W.allFinite() || !R_WT.coeffs().allFinite()) return Outcome::invalid;
  if (R_WT.coeffs() != start_.R_WT.coeffs()) aim(R_WT);
  if (!asked_ || asked_W_ != q_W) static_cast<void>(contains(q_W));
  if (solution_.status == models::InverseKinematicsResult::Status::invalid) return Outcome::invalid;
  if (!allowed_) return go_limited(q_W);
  lags_ = catches_up_;
  accept(solution_.q);
  return catches_up_ ? Outcome::lags : Outcome::reached;
}

// Finds the step by Newton's method on the place. Each quadratic program uses the kinematics linearised at the last
// solution.
ArmStep::Outcome ArmStep::go_limited(const Vec3& x_W) noexcept {
  if (!linearised_) start_model();
  use_box(first_ease);
  bool reached = false, leaves = true;
  JointVector u = brakes_;
  for (int round = 0; round < most_rounds; ++round) {
    const Rows J_p = model_.at.J_W.topRows<3>();
    const Vec3 wanted = x_W - model_.at.X_WT.translation() + J_p * model_.u;
    reached = solve_at(model_, J_p, wanted);
    while (!reached && ease_ < whole_box) {
      use_box(ease_ * next_ease);
      reached = solve_at(model_, J_p, wanted);
    }
    const bool solved = reached || solve_near(model_, J_p, wanted);
    u = solved ? JointVector(program_.u().cwiseMax(box_.low).cwiseMin(box_.high)) : hardest_braking();
    active_ = pressing();
    leaves = leave_curved_sets(model_, u);
    if (leaves) continue;
    const double change = (u - model_.u).cwiseAbs().maxCoeff();
    linearise(u, model_);
    const Vec3 left = inverse_->space().projection() * (x_W - model_.at.X_WT.translation());
    if (reached ? left.norm() <= place_tolerance_m : change <= rounding_rad) break;
  }
  if (leaves) linearise(taken_back(model_, u), model_);
  lags_ = true;
  solution_.kinematics = model_.at;
  accept(link_rad_ + model_.u);
  return reached && !leaves ? Outcome::lags : Outcome::held;
}

void ArmStep::accept(const JointVector& link_rad) noexcept {
  step_rad_ = link_rad - link_rad_;
  link_rad_ = solution_.q = link_rad;
}

void ArmStep::archive(fieldbus::StateArchive& state) noexcept {
  state(link_rad_, step_rad_, lags_, catching_rad_per_s_);
  if (state.reading()) arm_->kinematics(link_rad_, solution_.kinematics);
}

}  // namespace proxarm::controller
