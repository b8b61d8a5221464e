#include "controller/extras/proof/proof_session.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace proxarm::proof {
namespace {

using controller::Event;
using controller::Fault;
using controller::Phase;
using models::JointVector;
using models::Vec3;

// Shares of the speed limits at which paths stay, since T moves along arcs and drives overshoot.
constexpr double share_of_speed = 0.7, share_of_joint_speed = 0.25, peak_of_minimum_jerk = 15.0 / 8.0;
// A force above push_N that lasts for steady_s is a push. A force below no_push_N that lasts for steady_s is the push's
// end.
constexpr double push_N = 8.0, no_push_N = 2.0, steady_s = 0.3, push_timeout_s = 60.0;
constexpr double run_out_s = 0.1, brakes_watched_s = 1.0, disable_timeout_s = 1.0;

description::CellLimits slow(description::CellLimits limits) {
  limits.max_tool_speed_m_per_s = std::min(limits.max_tool_speed_m_per_s, proof_speed_m_per_s);
  return limits;
}

std::vector<description::DriveDescription> drives_of(const controller::CycleParts& parts) {
  std::vector<description::DriveDescription> drives;
  for (const controller::DriveOnBus& axis : parts.drives) drives.push_back(axis.drive.description());
  return drives;
}

double longest_feedback_s(const controller::CycleParts& parts) {
  double longest = 0.0;
  for (const controller::DriveOnBus& axis : parts.drives) {
    longest = std::max(longest, axis.drive.feedback_period_s());
  }
  return longest;
}

}  // namespace

ProofSession::ProofSession(controller::CycleParts parts, const controller::SessionSettings& settings,
                           const description::Cell& cell, Task task)
    : parts_(std::move(parts)),
      settings_(settings),
      cell_(cell),
      task_(std::move(task)),
      limits_(slow(cell.limits)),
      supervisor_(controller::reactions_of(parts_.supervision)),
      alarm_(supervisor_, cycle_),
      recorder_(1),
      bus_(parts_, recorder_, alarm_),
      measurement_(parts_.drives, *parts_.sensor, *parts_.arm, parts_.compensation, settings.period_s),
      faults_(parts_.drives, settings_, {limits_.max_force_N, parts_.supervision.max_bias_drift_N}, supervisor_, alarm_,
              controller::ToolMonitor(limits_, settings.max_missed_feedback, longest_feedback_s(parts_)),
              controller::DriveMonitor(*parts_.arm, drives_of(parts_), limits_.following_error_rad)) {
  setpoints_.values = parts_.arm->start_rad();
  from_rad_ = way_rad_ = braked_rad_ = JointVector::Zero(parts_.arm->axes());
}

void ProofSession::run_cycle(std::int64_t t_k_ns) noexcept {
  recorder_.begin(t_k_ns, [](fieldbus::StateArchive&) noexcept {});
  if (cycle_ == 0) {
    first_ns_ = since_ns_ = t_k_ns;
    asked_ = parts_.enabling ? Asked::press : Asked::nothing;
    if (!parts_.enabling) supervisor_.handle(Event::begin);
  }
  bus_.begin(t_k_ns);
  bus_.receive_until(t_k_ns + std::llround(0.45e9 * settings_.period_s), listener_);
  measurement_.take();
  faults_.judge_encoders(measurement_.now(), entered_);
  heed(t_k_ns);
  act(t_k_ns);
  if (supervisor_.phase() != entered_) enter(t_k_ns);
  bus_.send_setpoints(setpoints_, t_k_ns, cycle_);
  bus_.hand_over();
  ++cycle_;
}

// Handles events from outside. A hold ends the session, too, since nothing can be resumed here.
void ProofSession::heed(std::int64_t t_k_ns) noexcept {
  if (stop_.load()) supervisor_.handle(Event::stop);
  if (parts_.enabling) {
    parts_.enabling->on_cycle(t_k_ns);
    if (parts_.enabling->take_press() && supervisor_.phase() == Phase::idle) supervisor_.handle(Event::begin);
  }
  faults_.judge({.measured = measurement_.now(),
                 .sample = parts_.sensor->latest(),
                 .enabling = parts_.enabling ? &*parts_.enabling : nullptr,
                 .buses = bus_.read_status()});
  if (supervisor_.phase() == Phase::holding) supervisor_.handle(Event::stop);
  if (supervisor_.phase() != entered_) enter(t_k_ns);
}

void ProofSession::enter(std::int64_t t_k_ns) noexcept {
  entered_ = supervisor_.phase();
  since_ns_ = t_k_ns;
  if (entered_ != Phase::rendering) asked_ = Asked::nothing;
  bus_.request(entered_ < Phase::disabling ? fieldbus::DriveGoal::operation_enabled : goal_off());
  if (entered_ == Phase::rendering) from_rad_ = setpoints_.values;
}

fieldbus::DriveGoal ProofSession::goal_off() const noexcept {
  return supervisor_.cuts_power() ? fieldbus::DriveGoal::none : fieldbus::DriveGoal::switched_off;
}

void ProofSession::act(std::int64_t t_k_ns) noexcept {
  const double in_phase_s = 1e-9 * static_cast<double>(t_k_ns - since_ns_);
  switch (entered_) {
    case Phase::idle:
      setpoints_.values = measurement_.now().motor_rad;
      if (in_phase_s > settings_.enabling_timeout_s) alarm_.raise(Fault::enabling_not_pressed);
      return;
    case Phase::enabling:
      return wait_for_drives(in_phase_s);
    case Phase::taring:
      return tare(in_phase_s);
    case Phase::rendering:
      return follow_plan();
    case Phase::stopping:
      rate_ = std::max(0.0, rate_ - settings_.period_s / run_out_s);
      step_ == Step::exercising ? exercise() : move();
      if (rate_ <= 0.0) supervisor_.handle(Event::at_rest);
      return;
    case Phase::disabling:
      bus_.request(goal_off());  // the goal may have changed, since a drive may have deviated in this phase
      return watch_brakes(in_phase_s);
    default:
      return;
  }
}

void ProofSession::wait_for_drives(double in_phase_s) noexcept {
  const controller::Measured& measured = measurement_.now();
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    if ((measured.following & 1u << i) == 0) setpoints_.values[i] = measured.motor_rad[i];
  }
  if (std::countr_one(measured.following) >= static_cast<int>(measured.axes())) {
    supervisor_.handle(Event::enabled);
    return;
  }
  const auto overdue =
      controller::first_overdue(parts_.drives, measured.following, in_phase_s, settings_.enable_timeout_s);
  if (overdue.drive >= 0) alarm_.raise(Fault::drive_not_enabled, overdue.drive, in_phase_s, overdue.limit_s);
}

void ProofSession::tare(double in_phase_s) noexcept {
  if (measurement_.tare(settings_, in_phase_s, alarm_)) supervisor_.handle(Event::tared);
}

bool ProofSession::needs_plan() const noexcept { return entered_ == Phase::rendering && stations_.empty(); }

void ProofSession::begin_plan() {
  std::vector<Station> stations =
      task_.stations ? task_.stations(setpoints_.values) : plan(cell_, *parts_.arm, setpoints_.values);
  readings_.reserve(stations.size());
  stations_ = std::move(stations);
  begin_move(stations_.front().motor_rad);
}

void ProofSession::begin_move(const JointVector& to_rad) noexcept {
  from_rad_ = setpoints_.values;
  way_rad_ = to_rad - from_rad_;
  models::ToolKinematics at;
  double tool_m = 0.0, joints_s = 0.0;
  for (const JointVector& end : {from_rad_, to_rad}) {
    parts_.arm->kinematics(end, at);
    double way_m = 0.0;
    for (Eigen::Index i = 0; i < way_rad_.size(); ++i) way_m += std::abs(way_rad_[i]) * at.J_W.col(i).head<3>().norm();
    tool_m = std::max(tool_m, way_m);
  }
  for (Eigen::Index i = 0; i < way_rad_.size(); ++i) {
    const double most = cell_.drives[static_cast<std::size_t>(i)].max_speed_rad_per_s;
    joints_s = std::max(joints_s, std::abs(way_rad_[i]) / (share_of_joint_speed * most));
  }
  const double tool_s = tool_m / (share_of_speed * limits_.max_tool_speed_m_per_s);
  duration_s_ = peak_of_minimum_jerk * std::max(tool_s, joints_s);
  path_s_ = 0.0;
  go_to(Step::moving);
}

void ProofSession::go_to(Step step) noexcept {
  step_ = step;
  step_s_ = pressed_s_ = exercise_s_ = 0.0;
  gathered_ = {};
  const bool asks = step == Step::waiting, frees = step == Step::releasing;
  asked_ = asks ? Asked::push : frees ? Asked::let_go : Asked::nothing;
}

// Follows the minimum-jerk path (Flash and Hogan 1985): x = x₀ + (x₁ − x₀)(10 s³ − 15 s⁴ + 6 s⁵).
void ProofSession::move() noexcept {
  if (stations_.empty()) return;
  path_s_ = std::min(duration_s_, path_s_ + rate_ * settings_.period_s);
  const double s = duration_s_ > 0.0 ? path_s_ / duration_s_ : 1.0;
  setpoints_.values = from_rad_ + s * s * s * (10.0 + s * (-15.0 + s * 6.0)) * way_rad_;
}

// Exercises. While the arm is being stopped, the time of the exercise passes more slowly.
void ProofSession::exercise() noexcept {
  exercise_s_ += rate_ * settings_.period_s;
  setpoints_.values = stations_[station_].motor_rad + task_.exercise->offset_rad(station_, exercise_s_);
}

void ProofSession::follow_plan() noexcept {
  if (stations_.empty() || station_ >= stations_.size()) return;
  step_s_ += settings_.period_s;
  switch (step_) {
    case Step::moving:
      move();
      if (path_s_ >= duration_s_) go_to(Step::settling);
      return;
    case Step::settling:
      if (step_s_ < task_.settle_s) return;
      if (task_.exercise) return go_to(Step::exercising);
      return go_to(stations_[station_].push_W.isZero() ? Step::reading : Step::waiting);
    case Step::exercising:
      task_.exercise->take(station_, exercise_s_, {measurement_.now(), parts_.drives});
      exercise();
      if (exercise_s_ >= task_.exercise->lasts_s(station_)) go_to(Step::reading);
      return;
    case Step::waiting:
      return wait_for_push(true);
    case Step::reading:
      return read();
    case Step::releasing:
      return wait_for_push(false);
  }
}

void ProofSession::wait_for_push(bool pressed) noexcept {
  const double force_N = (measurement_.now().reading_S.force - unpushed_S_).norm();
  const bool is_so = pressed ? force_N >= push_N : force_N <= no_push_N;
  pressed_s_ = is_so ? pressed_s_ + settings_.period_s : 0.0;
  if (step_s_ > push_timeout_s) {
    not_pushed_ = true;
    supervisor_.handle(Event::stop);
  } else if (pressed_s_ >= steady_s) {
    pressed ? go_to(Step::reading) : next_station();
  }
}

void ProofSession::add_sample(const models::Wrench& reading_S) noexcept {
  Gathered& g = gathered_;
  if (g.samples > 0) {
    g.step_squares_S.force += (reading_S.force - g.last_S.force).cwiseAbs2();
    g.step_squares_S.torque += (reading_S.torque - g.last_S.torque).cwiseAbs2();
  }
  g.last_S = reading_S;
  g.sum_S.force += reading_S.force;
  g.sum_S.torque += reading_S.torque;
  ++g.samples;
}

void ProofSession::read() noexcept {
  const controller::Measured& measured = measurement_.now();
  if (measured.sample_is_new) add_sample(measured.reading_S);
  const Gathered& g = gathered_;
  if (step_s_ < task_.read_s || g.samples == 0) return;
  const Station& station = stations_[station_];
  const Vec3 mean_S = g.sum_S.force / g.samples;
  readings_.push_back({.station = station,  // begin_plan() has reserved the memory
                       .motor_rad = measured.motor_rad,
                       .force_S = mean_S,
                       .torque_S = g.sum_S.torque / g.samples,
                       .step_squares_S = g.step_squares_S,
                       .samples = g.samples,
                       .time_s = settings_.period_s * static_cast<double>(cycle_),
                       .lasted_s = step_s_});
  if (!station.push_W.isZero()) return go_to(Step::releasing);
  unpushed_S_ = mean_S;
  next_station();
}

void ProofSession::next_station() noexcept {
  ++station_;
  if (station_ >= stations_.size()) {
    asked_ = Asked::nothing;
    supervisor_.handle(Event::stop);
    return;
  }
  begin_move(stations_[station_].motor_rad);
}

// Waits until the drives are off and the brakes are closed. After that, no joint may move.
void ProofSession::watch_brakes(double in_phase_s) noexcept {
  const JointVector& motor_rad = measurement_.now().motor_rad;
  if (!bus_.drives_off()) {
    braked_rad_ = motor_rad;
    if (in_phase_s <= disable_timeout_s) return;
    alarm_.raise(Fault::drive_not_disabled, bus_.first_drive_on());
    supervisor_.handle(Event::disabled);
    return;
  }
  slipped_rad_ = std::max(slipped_rad_.value_or(0.0), (motor_rad - braked_rad_).cwiseAbs().maxCoeff());
  if (in_phase_s > brakes_watched_s || supervisor_.faulted()) supervisor_.handle(Event::disabled);
}

}  // namespace proxarm::proof
