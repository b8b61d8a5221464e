#include "controller/motion/admittance_motion.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

// Each step keeps the proxy within the leash's set, to 1e-9 m or better; this margin is well above that.
constexpr double leash_tolerance_m = 1e-6;
// The tool's speed limit changes by at most this deceleration or acceleration, and by at most a quarter of the
// acceleration that the cell allows. The sets of speed and of acceleration therefore always have points in common.
constexpr double speed_limit_m_per_s2 = 1.0;
// If nothing was touched, the hand's force shows the direction to back off in; it must exceed this.
constexpr double pinning_force_N = 5.0;
// The largest share of the tool's speed limit that is commanded: the same as for the proxy (step_limits.cpp).
constexpr double commanded_share = 0.9;
// A joint that is nearer to its limit than this share of what it may move in a step is told to be at it.
constexpr double at_limit = 1e-3;
// Joints that turn the tool less than its proxy use this share of their accelerations. The rest is for the twist of the
// gears.
constexpr double turning_share = 0.75;
// 2⁻⁸ of a step that is shortened is some micrometres.
constexpr int bisections = 8;
// A torque that turns the tool counts as the force that makes it at this lever, the length of a handle.
constexpr double torque_lever_m = 0.1;

Eigen::Quaterniond orientation_of(const models::Pose& X_WT) noexcept {
  return Eigen::Quaterniond(X_WT.linear()).normalized();
}

// Who can't follow a motion, and is what the motion goes on from, gives it no energy: joints that turn the tool faster
// than its proxy for a moment would make it swing by itself.
Vec3 no_faster(const Vec3& omega_W, double most) noexcept {
  const double speed = omega_W.norm();
  return speed > most ? Vec3(most / speed * omega_W) : omega_W;
}

Damping damping_by(Passivity passivity) noexcept {
  if (passivity == Passivity::on) return Damping::at_once;
  return passivity == Passivity::automatic ? Damping::what_lasts : Damping::never;
}

}  // namespace

AdmittanceMotion::AdmittanceMotion(AdmittanceParts parts, const models::Arm& arm,
                                   std::vector<description::DriveDescription> drives,
                                   const description::CellLimits& limits,
                                   const description::SupervisionDescription& supervision,
                                   const SessionSettings& settings, double tool_mass_kg)
    : parts_(std::move(parts)),
      arm_(arm),
      drives_(std::move(drives)),
      limits_(limits),
      supervision_(supervision),
      period_s_(settings.period_s),
      tool_mass_kg_(tool_mass_kg),
      limiter_(drives_, limits, settings.period_s),
      joint_limits_(arm, drives_, settings.period_s),
      guard_(drives_, settings.period_s),
      tool_guard_(arm, drives_, limits, settings.period_s) {
  state_.link_rad = solution_.q = arm.start_rad();
  state_.link_step_rad = state_.run_out_rad_per_s = JointVector::Zero(arm.axes());
  state_.speed_limit_m_per_s = limits.max_tool_speed_m_per_s;
  start_guards(arm.start_rad());
  arm.kinematics(arm.start_rad(), solution_.kinematics);
  R_TS_ = solution_.kinematics.X_WT.linear().transpose() * solution_.kinematics.X_WS.linear();
  if (settings.looks_ahead) sent_.emplace(limits, settings.horizon_s, settings.period_s);
  if (supervision.let_go != description::LetGo::coast) {
    const bool turns = settings.orientation == OrientationMode::free;
    empty_handle_.emplace(EmptyHandleConfig{.band_N = supervision.empty_handle_N,
                                            .tool_mass_kg = tool_mass_kg,
                                            .lever_m = turns ? torque_lever_m : 0.0},
                          settings.period_s);
  }
  if (settings.passivity != Passivity::off) {
    passivity_.emplace(PassivityConfig{.force_age_s = settings.force_age_s}, settings.period_s,
                       damping_by(settings.passivity));
  }
}

// ---- beginnings and ends

// The first setpoint equals the last one.
void AdmittanceMotion::start(const Measured& measured, Beginning beginning) noexcept {
  const JointVector target_rad = guard_.target_rad();
  state_.freeing = beginning == Beginning::freeing;
  state_.force_share = 0.0;
  state_.link_rad = arm_.link_from_motor(target_rad);
  const models::Pose X_WT = arm_.tool_pose(state_.link_rad);
  state_.q_k1_W = state_.q_k2_W = X_WT.translation();
  arm_.kinematics(state_.link_rad, solution_.kinematics);
  parts_.inverse.set_posture(state_.link_rad);
  parts_.elastic.start(state_.link_rad);
  state_.link_step_rad.setZero();
  start_guards(target_rad);
  if (pose() != nullptr) pose()->turn_to(orientation_of(X_WT), Vec3::Zero());
  world().start(state_.q_k1_W);
  if (sent_) sent_->start(state_.q_k1_W);
  if (passivity_) passivity_->start(measured.tool_W);
  if (parts_.links) parts_.links->start(measured.link_rad);
  if (empty_handle_) empty_handle_->start();
  reversed_.start();
  straight_.start();
  parts_.orientation.start(orientation_of(X_WT));
  if (beginning == Beginning::resuming) {
    state_.speed_limit_m_per_s = std::min(state_.speed_limit_m_per_s, supervision_.release_speed_m_per_s);
  }
}

void AdmittanceMotion::start_guards(const JointVector& target_rad) noexcept {
  guard_.start(target_rad);
  tool_guard_.start(target_rad);
  envelope_.start(target_rad);
}

// Every joint decelerates from its last speed in the same time: the longest that any joint needs at its own
// deceleration.
void AdmittanceMotion::start_run_out() noexcept {
  double stop_s = period_s_;
  for (Eigen::Index i = 0; i < guard_.speed_rad_per_s().size(); ++i) {
    const double deceleration = drives_[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2;
    stop_s = std::max(stop_s, std::abs(guard_.speed_rad_per_s()[i]) / deceleration);
  }
  guard_.follow_from_here();
  state_.run_out_rad_per_s = guard_.speed_rad_per_s();
  state_.run_out_share = 1.0;
  state_.run_out_per_cycle = period_s_ / stop_s;
}

void AdmittanceMotion::run_out() noexcept {
  state_.run_out_share = std::max(0.0, state_.run_out_share - state_.run_out_per_cycle);
  make_final(guard_.target_rad() + state_.run_out_share * period_s_ * state_.run_out_rad_per_s,
             limits_.max_tool_speed_m_per_s);
}

void AdmittanceMotion::set_period(double period_s) noexcept {
  period_s_ = period_s;
  parts_.inverse.set_max_step(max_steps_rad(drives_, period_s));
  parts_.elastic.set_period(period_s);
  parts_.orientation.set_period(period_s);
  parts_.world->set_period(period_s);
  parts_.release->set_period(period_s);
  if (passivity_) passivity_->set_period(period_s);
  if (parts_.links) parts_.links->set_period(period_s);
  if (empty_handle_) empty_handle_->set_period(period_s);
  limiter_.set_period(period_s);
  joint_limits_.set_period(period_s);
  if (sent_) sent_->set_period(period_s);
  guard_.set_period(period_s);
  tool_guard_.set_period(period_s);
}

// With another mass, damping or spring the prediction yields another point, to which the arm moves slowly.
void AdmittanceMotion::set(const Change& change) noexcept {
  parts_.world->set(change);
  if (change.parameter == Parameter::inertia) parts_.orientation.set_inertia(change.value, parts_.behind_sensor_T);
  if (change.parameter == Parameter::turning_damping) parts_.orientation.set_damping(change.value);
  if (change.parameter == Parameter::turning_spring) parts_.orientation.set_spring(change.value);
  if (!sent_) return;
  switch (change.parameter) {
    case Parameter::lookahead:
      return sent_->want(change.value);
    case Parameter::mass:
    case Parameter::damping:
    case Parameter::spring:
      return sent_->take_up_change();
    case Parameter::friction:
    case Parameter::position:
    case Parameter::inertia:
    case Parameter::turning_damping:
    case Parameter::turning_spring:
    case Parameter::none:
      return;
  }
}

void AdmittanceMotion::archive(fieldbus::StateArchive& state) noexcept {
  parts_.world->archive(state);
  parts_.release->archive(state);
  if (passivity_) passivity_->archive(state);
  if (parts_.links) parts_.links->archive(state);
  if (empty_handle_) empty_handle_->archive(state);
  if (sent_) sent_->archive(state);
  state(parts_.elastic, parts_.orientation, guard_, tool_guard_, envelope_, reversed_, straight_,
        parts_.inverse.posture());
  archive_fields(state, state_);
  if (state.reading()) arm_.kinematics(state_.link_rad, solution_.kinematics);
}

// ---- rendering

bool AdmittanceMotion::render(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  make_limits(cycle);
  if (passivity_) observe_hand(measured);
  let_force_in(cycle.record);
  const models::Wrench h_W = acting_wrench_W(cycle);
  if (parts_.pose != nullptr) parts_.pose->set_torque_W(h_W.torque);
  const WorldStep step = parts_.world->step(h_W.force, step_limits_);
  const ProxyFault turned = turn(h_W.torque);
  if (step.fault != ProxyFault::none || turned != ProxyFault::none) {
    cycle.alarm.raise(step.fault == ProxyFault::squeezed ? Fault::proxy_squeezed : Fault::proxy_not_finite);
    return false;
  }
  active_.add(step.limits);
  state_.mass_kg = step.mass_kg;
  state_.damping_Ns_per_m = step.damping_Ns_per_m;
  state_.touches = step.contacts > 0;
  advance_proxy(step.q_W);
  if (step.settled) state_.q_k2_W = state_.q_k1_W;
  record_world(step, cycle.record);
  if (step.contacts > 0) state_.last_normal_W = step.normal_W;
  if (passivity_) record_passivity(step, cycle.record);
  if (sent_) send_ahead();
  const bool turning_limited = parts_.pose != nullptr
                                   ? parts_.pose->turning_limited()
                                   : parts_.orientation.speed_limited() || parts_.orientation.angle_limited();
  cycle.record.set(RecordFlag::limit_orientation, turning_limited);
  follow_proxy(cycle);
  count_work(step);
  const double distance_m = std::max((measured.tool_W - state_.q_k1_W).norm(), turned_away_m(measured));
  if (!(distance_m <= limits_.leash_m + leash_tolerance_m)) {
    cycle.alarm.raise(Fault::leash_exceeded, -1, distance_m, limits_.leash_m);
  }
  return true;
}

// How far the end of a handle is from where the proxy would have it, by what the arm lags in turning.
double AdmittanceMotion::turned_away_m(const Measured& measured) const noexcept {
  if (!parts_.orientation.config().free) return 0.0;
  const Eigen::Quaterniond R_WT(models::Mat3(measured.R_WS * R_TS_.transpose()));
  return torque_lever_m * R_WT.angularDistance(parts_.orientation.R_WT());
}

// A rigid tool has turned in its world's step.
ProxyFault AdmittanceMotion::turn(const Vec3& torque_W) noexcept {
  if (parts_.pose == nullptr) return parts_.orientation.step(torque_W);
  parts_.orientation.resume(parts_.pose->orientation(), parts_.pose->angular_velocity_W());
  return ProxyFault::none;
}

// Makes the sets that limit this step: around the proxy, and around the motion commanded behind the setpoints' filter.
void AdmittanceMotion::make_limits(const MotionCycle& cycle) noexcept {
  limit_speed(cycle);
  const models::ToolKinematics& filtered = parts_.elastic.kinematics();
  StepStart start{.q_k1_W = state_.q_k1_W,
                  .q_k2_W = state_.q_k2_W,
                  .filtered_W = filtered.X_WT.translation(),
                  .filtered_velocity_W = filtered.J_W.topRows<3>() * parts_.elastic.link_rad_per_s(),
                  .measured_W = cycle.measured.tool_W,
                  .force_N = cycle.measured.hand_W.force.norm(),
                  .max_speed_m_per_s = state_.speed_limit_m_per_s};
  const StepStart sent = start;
  if (sent_) {
    start.filtered_W = sent_->filtered_W();
    start.filtered_velocity_W = sent_->filtered_velocity_W();
  }
  joint_limits_.begin(state_.link_rad, guard_.target_rad() - parts_.elastic.link_rad(), solution_.kinematics.J_W);
  limiter_.make(start, &joint_limits_, step_limits_);
  if (sent_) make_sent_limits(sent);
}

// Makes the sets around the point that the arm is sent to. The arm's acceleration limits this point; the proxy's
// acceleration is limited against a filter of its own.
void AdmittanceMotion::make_sent_limits(StepStart start) noexcept {
  start.q_k1_W = sent_->c_k1_W();
  start.q_k2_W = sent_->c_k2_W();
  limiter_.make(start, &joint_limits_, sent_limits_);
}

// The arm is sent to the point where the proxy would be after the horizon H if it coasted. If the hand's force h were
// held meanwhile, the proxy would be ½H²h/M further. That term is left out, because the sensor at the handle also
// measures the inertia of the hand's own mass, which the term would feed back: the arm's elastic modes would then stay
// calm only up to half as long a horizon (docs/design.md has the figures).
void AdmittanceMotion::send_ahead() noexcept {
  sent_->advance_horizon();
  sent_->step(state_.q_k1_W, world().look_ahead(Vec3::Zero(), step_limits_, ahead_s()), sent_limits_);
  active_.add(sent_->active());
}

// The arm goes on from c_W. So does the proxy, which is behind c_W by the distance that is looked ahead.
void AdmittanceMotion::go_on_from(const Vec3& c_W, const Vec3& velocity_W) noexcept {
  const Vec3 q_W = sent_ ? sent_->resume(c_W, velocity_W, ahead_s()) : c_W;
  state_.q_k2_W = state_.q_k1_W = world().resume(q_W, velocity_W);
}

// Moves the tool's speed limit towards the one wanted in this cycle. While the tool stands, a lower one holds at once.
void AdmittanceMotion::limit_speed(const MotionCycle& cycle) noexcept {
  const double most = limits_.max_tool_speed_m_per_s;
  double wanted = cycle.slowed ? std::min(supervision_.slow_speed_m_per_s, most) : most;
  if (state_.freeing) wanted = std::min(parts_.release->speed_m_per_s(), wanted);
  const double step = period_s_ * std::min(speed_limit_m_per_s2, 0.25 * limits_.max_tool_acceleration_m_per_s2);
  double& limit = state_.speed_limit_m_per_s;
  limit = std::clamp(wanted, limit - step, limit + step);
  if (state_.q_k1_W == state_.q_k2_W && guard_.at_rest()) limit = std::min(limit, wanted);
  const double share = std::min(1.0, limit / most);
  parts_.orientation.limit_speed(share);
  if (parts_.pose != nullptr) parts_.pose->limit_turning(share);
  cycle.record.set(RecordFlag::slowed, !state_.freeing && limit < most);
}

// Raises the share of the hand's force that reaches the proxy linearly from 0 to 1 over ramp_in_s.
void AdmittanceMotion::let_force_in(CycleRecord& record) noexcept {
  if (state_.force_share >= 1.0) return;
  const double ramp_s = supervision_.ramp_in_s;
  state_.force_share = ramp_s > 0.0 ? std::min(1.0, state_.force_share + period_s_ / ramp_s) : 1.0;
  record.set(RecordFlag::ramp_in, state_.force_share < 1.0);
}

// The hand's wrench times the share that is let in; a braking force if nobody holds the handle.
models::Wrench AdmittanceMotion::acting_wrench_W(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  const models::Wrench hand_W{state_.force_share * measured.hand_W.force, state_.force_share * measured.hand_W.torque};
  const Vec3 v_W = (state_.q_k1_W - state_.q_k2_W) / period_s_;
  if (!empty_handle_) {
    judge_force(cycle, v_W, false);
    return hand_W;
  }
  const bool empty = empty_handle_->step({.hand_W = measured.hand_W,
                                          .noise_N = measured.bias.noise_N,
                                          .noise_is_white = measured.bias.noise_is_white,
                                          .tare_samples = measured.bias.samples,
                                          .sample_cycles = measured.bias.sample_cycles,
                                          .v_W = v_W,
                                          .mass_kg = state_.mass_kg});
  cycle.record.set(RecordFlag::hands_off, empty);
  judge_force(cycle, v_W, empty && !empty_handle_->led());
  if (!empty) return hand_W;
  return {empty_handle_->braking_force_W(state_.mass_kg, v_W), parts_.orientation.braking_torque_W()};
}

// Judges whether a hand can have made this force, given the motion that followed.
void AdmittanceMotion::judge_force(const MotionCycle& cycle, const Vec3& v_W, bool empty) noexcept {
  const SensorBias& bias = cycle.measured.bias;
  const ForceAndMotion now{.force_W = cycle.measured.hand_W.force,
                           .q_W = state_.q_k1_W,
                           .v_W = v_W,
                           .mass_kg = state_.mass_kg,
                           .damping_Ns_per_m = state_.damping_Ns_per_m,
                           .period_s = period_s_,
                           .free = !state_.touches};
  const double force_N = now.force_W.norm();
  if (reversed_.step(now)) cycle.alarm.raise(Fault::force_reversed, -1, force_N, 0.0);
  if (straight_.step(now, empty, bias.noise_N)) {
    cycle.alarm.raise(Fault::sensor_drifts, -1, force_N, supervision_.max_bias_drift_N);
  }
}

void AdmittanceMotion::advance_proxy(const Vec3& q_W) noexcept {
  state_.q_k2_W = state_.q_k1_W;
  state_.q_k1_W = q_W;
}

void AdmittanceMotion::count_work(const WorldStep& step) noexcept {
  ++work_.steps;
  work_.joint_limits = joint_limits_.counts().made;
  work_.joint_bounds = joint_limits_.counts().bounds;
  if (step.limits.kinds != 0) ++work_.limited;
  work_.joint_steps += static_cast<std::uint64_t>(solution_.iterations);
  work_.guarded = tool_guard_.judged_exactly();
}

// ρ² of what is felt, with the tool behind the sensor; 0 before the first step.
double AdmittanceMotion::gyration_m2() const noexcept {
  return state_.mass_kg > 0.0 ? parts_.orientation.config().inertia_kg_m2 / (state_.mass_kg + tool_mass_kg_) : 0.0;
}

void AdmittanceMotion::observe_hand(const Measured& measured) noexcept {
  if (!parts_.links) {
    return parts_.world->add_damping(passivity_->observe_hand(measured.hand_W.force, measured.tool_W));
  }
  const double rho2 = gyration_m2();
  const double added =
      passivity_->observe_hand(measured.hand_W, parts_.links->step(measured.link_rad, measured.hand_W), rho2);
  parts_.world->add_damping(added);
  if (pose() != nullptr) return pose()->add_turning_damping(rho2 * added);
  parts_.orientation.add_damping(rho2 * added);
}

void AdmittanceMotion::observe_proxy(const WorldStep& step) noexcept {
  const Vec3 force_W = step.f_W + step.limit_force_W;
  if (!parts_.links) return passivity_->observe_proxy(step.v_W, force_W, step.mass_kg, step.damping_Ns_per_m);
  const OrientationProxy& turns = parts_.orientation;
  const bool rigid = parts_.pose != nullptr;
  TurningPort port{
      .kinetic_J = rigid ? parts_.pose->kinetic_J() : 0.5 * step.mass_kg * step.v_W.squaredNorm() + turns.kinetic_J(),
      .damping_Ns_per_m = step.damping_Ns_per_m,
      .turning_damping_Nms_per_rad = rigid ? parts_.pose->turning_damping_Nms_per_rad() : turns.damping_Nms_per_rad()};
  port.velocity_W << step.v_W, turns.velocity_W();
  port.world_W << force_W, rigid ? Vec3(step.torque_W + step.limit_torque_W) : turns.limit_torque_W();
  passivity_->observe_proxy(port);
}

void AdmittanceMotion::record_passivity(const WorldStep& step, CycleRecord& record) noexcept {
  observe_proxy(step);
  if (parts_.links) {
    record.links_W_m = triple(passivity_->moved_W().head<3>());
    record.links_W_rad = triple(passivity_->moved_W().tail<3>());
  }
  record.energies_J = passivity_->energies_J();
  record.added_damping_Ns_per_m = passivity_->added_damping_Ns_per_m();
  record.oscillation_m_per_s = passivity_->oscillation_m_per_s();
  record.felt_damping_Ns_per_m = passivity_->felt_damping_Ns_per_m();
  record.set(RecordFlag::oscillation, passivity_->oscillates());
  record.set(RecordFlag::oscillation_lasts, passivity_->lasts());
}

// ---- getting free

// The part of a force that can move the tool. In an arm with few axes, which moves in a plane or along a line, the
// structure carries the rest.
Vec3 AdmittanceMotion::moving_force_W(const Vec3& force_W) const noexcept {
  const models::ToolSpace& space = parts_.inverse.space();
  return space.dimensions == 3 ? force_W : Vec3(space.projection() * force_W);
}

// The tool backs off from the object touched last, or in the direction of the hand's push if nothing was touched.
bool AdmittanceMotion::prepare_freeing(const Command& command, const Measured& measured) noexcept {
  if (command.order == Order::release) {
    parts_.release->start_release();
    return true;
  }
  const Vec3 force_W = moving_force_W(measured.hand_W.force);
  Vec3 n_W = state_.last_normal_W;
  if (n_W.isZero(0.0) && force_W.norm() > pinning_force_N) n_W = force_W.normalized();
  if (n_W.isZero(0.0) || !(command.value > 0.0)) return false;
  const Vec3 start_W = arm_.tool_pose(arm_.link_from_motor(guard_.target_rad())).translation();
  parts_.release->start_back_off(start_W, n_W, command.value, force_W);
  return true;
}

bool AdmittanceMotion::start_yielding(const Measured& measured) noexcept {
  const Vec3 force_W = moving_force_W(measured.hand_W.force);
  if (!force_W.allFinite() || force_W.norm() < Release::yielded_N) return false;
  start(measured, Beginning::freeing);
  parts_.release->start_yield(state_.q_k1_W, force_W);
  return true;
}

bool AdmittanceMotion::free(const MotionCycle& cycle) noexcept {
  const Vec3 hand_W = moving_force_W(cycle.measured.hand_W.force);
  make_limits(cycle);
  const Vec3 v_W = (state_.q_k1_W - state_.q_k2_W) / period_s_;
  const Vec3 h_W = parts_.release->force_W(state_.q_k1_W, v_W, hand_W);
  const WorldStep step = world().step(h_W, step_limits_);
  if (step.fault != ProxyFault::none) {
    cycle.alarm.raise(Fault::proxy_not_finite);
    return false;
  }
  active_.add(step.limits);
  advance_proxy(step.q_W);
  cycle.record.p_hat_W_m = triple(step.p_hat_W);
  if (sent_) send_ahead();
  follow_proxy(cycle);
  return parts_.release->over(state_.q_k1_W, hand_W);
}

// ---- from the proxy to the setpoints

// If the arm can't reach the proxy's pose (because of a singularity, or at the end of its reach), the proxy is set back
// to where the arm gets. Turning gives way first.
void AdmittanceMotion::follow_proxy(const MotionCycle& cycle) noexcept {
  models::Pose X_WT = models::Pose::Identity();
  X_WT.translation() = sent_W();
  X_WT.linear() = parts_.orientation.R_WT().toRotationMatrix();
  if (const OrientationConfig& turning = parts_.orientation.config(); turning.free) {
    cycle.record.proxy_inertia_kg_m2 = turning.inertia_kg_m2;
    cycle.record.proxy_turning_damping_Nms_per_rad = turning.damping_Nms_per_rad;
  }
  const Vec3 reached_k1_W = solution_.kinematics.X_WT.translation();
  const models::Mat3 reached_k1_rotation = solution_.kinematics.X_WT.linear();
  const JointVector link_k1_rad = state_.link_rad;
  parts_.inverse.solve(state_.link_rad, X_WT, solution_);
  if (solution_.status == models::InverseKinematicsResult::Status::invalid) return cycle.alarm.raise(Fault::singular);
  const bool turned_less = turn_less(link_k1_rad, X_WT);
  state_.link_rad = solution_.q;
  if (turned_less) {
    cycle.record.set(RecordFlag::limit_orientation, true);
    turn_on_from(reached_k1_rotation);
    if (pose() != nullptr) {
      const Vec3& reached_W = solution_.kinematics.X_WT.translation();
      const Vec3 velocity_W = (reached_W - reached_k1_W) / period_s_;
      go_on_from(reached_W, velocity_W);
      state_.q_k2_W = state_.q_k1_W - period_s_ * velocity_W;
    }
  } else if (solution_.status != models::InverseKinematicsResult::Status::converged) {
    active_.set(Limit::singularity);
    tool_guard_.strain();
    shorten_step(link_k1_rad, reached_k1_W);
    const Vec3& reached_W = solution_.kinematics.X_WT.translation();
    if (parts_.orientation.config().free) turn_on_from(reached_k1_rotation);
    go_on_from(reached_W, (reached_W - reached_k1_W) / period_s_);
  }
  state_.link_step_rad = state_.link_rad - link_k1_rad;
  move_motors(parts_.elastic.step(state_.link_rad), cycle.measured);
}

// Joints that can't turn the tool as its proxy turns lead it to its place all the same. Once they have, or where a
// joint's setpoint lags, they keep to the lower share of their accelerations until the proxy asks for no more than
// that.
bool AdmittanceMotion::turn_less(const JointVector& link_k1_rad, const models::Pose& X_WT) noexcept {
  if (!parts_.orientation.config().free) return false;
  const bool converged = solution_.status == models::InverseKinematicsResult::Status::converged;
  const double share = state_.turns_less || guard_.lags() ? turning_share : 1.0;
  state_.turns_less = false;
  if (converged && step_room(share).allows(solution_.q - link_k1_rad)) return false;
  const models::StepRoom room = step_room(turning_share);
  if (!parts_.inverse.reach_place(link_k1_rad, room, X_WT, solution_)) return false;
  state_.turns_less = true;
  tell_limits(room, solution_.q - link_k1_rad);
  return true;
}

// The bounds of the links' next step. As those of the tool, accelerations are those of what is commanded, behind the
// filter of the setpoints.
models::StepRoom AdmittanceMotion::step_room(double acceleration_share) const noexcept {
  const double T = period_s_;
  const bool filters = parts_.elastic.lead_s() > 0.0;
  const JointVector coasts =
      filters ? JointVector(parts_.elastic.coasting_rad() - state_.link_rad) : state_.link_step_rad;
  const double squared = filters ? parts_.elastic.input_s2() : T * T;
  const JointVector most = most_change();
  models::StepRoom room{.brakes_rad = braking_step(most),
                        .most_rad = coasts,
                        .low_rad = coasts,
                        .high_rad = coasts,
                        .eased_low_rad = coasts,
                        .eased_high_rad = coasts};
  for (Eigen::Index i = 0; i < coasts.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double change = acceleration_share * drives_[k].max_acceleration_rad_per_s2 * squared;
    room.most_rad[i] = drives_[k].max_speed_rad_per_s * T;
    room.low_rad[i] = -std::min(room.most_rad[i], joint_limits_.room_rad(k, -1.0));
    room.high_rad[i] = std::min(room.most_rad[i], joint_limits_.room_rad(k, 1.0));
    room.eased_low_rad[i] -= change;
    room.eased_high_rad[i] += change;
  }
  return room;
}

// By how much each joint may change its step: by half of its acceleration; the rest is left for the twist of the gears.
JointVector AdmittanceMotion::most_change() const noexcept {
  JointVector change(state_.link_step_rad.size());
  for (Eigen::Index i = 0; i < change.size(); ++i) {
    change[i] = 0.5 * drives_[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2 * period_s_ * period_s_;
  }
  return change;
}

// The next step if all joints brake together, in the time that the slowest of them needs.
JointVector AdmittanceMotion::braking_step(const JointVector& most_change) const noexcept {
  const JointVector& step_k1 = state_.link_step_rad;
  const double cycles = step_k1.cwiseAbs().cwiseQuotient(most_change).maxCoeff();
  return cycles > 1.0 ? JointVector((1.0 - 1.0 / cycles) * step_k1) : JointVector::Zero(step_k1.size());
}

void AdmittanceMotion::tell_limits(const models::StepRoom& room, const JointVector& step_rad) noexcept {
  for (Eigen::Index i = 0; i < step_rad.size(); ++i) {
    const auto bit = static_cast<std::uint8_t>(1u << i);
    const double slack = at_limit * room.most_rad[i];
    if (step_rad[i] <= room.low_rad[i] + slack || step_rad[i] >= room.high_rad[i] - slack) {
      active_.set(std::abs(step_rad[i]) >= room.most_rad[i] - slack ? Limit::joint_speed : Limit::joint_range, bit);
    } else if (step_rad[i] <= room.eased_low_rad[i] + slack || step_rad[i] >= room.eased_high_rad[i] - slack) {
      active_.set(Limit::joint_acceleration, bit);
    }
  }
}

// How fast the tool turns on where the arm couldn't follow: as fast as the proxy did, or, where that was slow, up to a
// quarter of the limit, since joints can't stop at once either.
double AdmittanceMotion::most_turning_rad_per_s() const noexcept {
  return std::max(parts_.orientation.velocity_W().norm(), 0.25 * limits_.max_turning_speed_rad_per_s);
}

// The tool turns on from the orientation that the arm has reached.
void AdmittanceMotion::turn_on_from(const models::Mat3& reached_k1) noexcept {
  const Eigen::Quaterniond reached = orientation_of(solution_.kinematics.X_WT);
  const Eigen::AngleAxisd turn(reached * Eigen::Quaterniond(reached_k1).conjugate());
  const Vec3 omega_W = no_faster(turn.angle() / period_s_ * turn.axis(), most_turning_rad_per_s());
  parts_.orientation.resume(reached, omega_W);
  if (pose() != nullptr) pose()->turn_to(reached, omega_W);
}

// If inverse kinematics doesn't converge, its step may be as large as the joints' speeds allow and may change direction
// from cycle to cycle, so the tool would jump by millimetres. The step is therefore interpolated towards the one that
// brakes all joints together, until two bounds hold. Each joint uses at most half of its acceleration. The tool goes no
// further than to the point that the arm is sent to, plus what the tool's acceleration allows in a period.
void AdmittanceMotion::shorten_step(const JointVector& link_k1_rad, const Vec3& reached_k1_W) noexcept {
  const double T = period_s_;
  const JointVector& step_k1 = state_.link_step_rad;
  const JointVector most_change = this->most_change();
  const JointVector brakes = link_k1_rad + braking_step(most_change);
  const JointVector way = solution_.q - brakes;
  double too_far = 1.0;
  for (Eigen::Index i = 0; i < way.size(); ++i) {
    const double coasting = link_k1_rad[i] + step_k1[i] - brakes[i];
    const double most = coasting + std::copysign(most_change[i], way[i]);
    if (std::abs(way[i]) > std::abs(most)) too_far = std::min(too_far, std::max(0.0, most / way[i]));
  }
  const double most_m = std::min(commanded_share * state_.speed_limit_m_per_s * T,
                                 (sent_W() - reached_k1_W).norm() + limits_.max_tool_acceleration_m_per_s2 * T * T);
  const auto goes_m = [&](double share) {
    return (arm_.tool_pose(brakes + share * way).translation() - reached_k1_W).norm();
  };
  double kept = too_far;
  if (goes_m(too_far) > most_m) {
    kept = 0.0;
    for (int i = 0; i < bisections; ++i) {
      const double share = 0.5 * (kept + too_far);
      (goes_m(share) <= most_m ? kept : too_far) = share;
    }
  }
  if (kept == 1.0) return;
  state_.link_rad = solution_.q = brakes + kept * way;
  arm_.kinematics(state_.link_rad, solution_.kinematics);
}

void AdmittanceMotion::move_motors(const JointVector& motor_rad, const Measured& measured) noexcept {
  JointVector wanted_rad = motor_rad;
  const std::uint8_t blocked = find_blocked(motor_rad, measured, wanted_rad);
  const bool held_back = make_final(wanted_rad, state_.speed_limit_m_per_s);
  if (blocked != 0) tool_guard_.relax();
  follow_setpoints(measured, blocked);
  made_setpoints_ = true;
  if (held_back || blocked != 0 || guard_.lag_rad() > limits_.following_error_rad) wind_back(blocked);
}

// Returns the joints whose drives are blocked, as bits. A blocked drive is commanded at most a little ahead of its
// reported position, and all other joints wait. The gears are thus wound up so little that nothing snaps when the drive
// comes free. The room around the report grows with speed, because a drive that follows its setpoint reports it with a
// lag: the setpoint on its way to the drive, and the answer on its way back.
//
// A false report must not lead the setpoint anywhere. Let θ be the report, r the room around it, w the wanted setpoint
// and [l, h] the envelope of the setpoints sent before the joint was blocked (setpoint_envelope.hpp). The command is
//     c = clamp(clamp(w, θ − r, θ + r), min(l, w), max(h, w))
// If the joint has jammed, θ is between l and h, so c = θ ± r: the setpoint brakes and comes back to the joint. If θ is
// outside, the encoder or the drive reports a false position, and c is w or a place to which the joint was sent before.
// If nobody is at the handle, proxy and filter go on from the last setpoint, which is therefore w; so l = h = w = c
// stays constant, whatever θ does. If somebody is, c goes no further than w, which the hand has made. No sequence of
// reports therefore moves the arm by more than it has moved within the lag, and without a hand none moves it at all.
std::uint8_t AdmittanceMotion::find_blocked(const JointVector& motor_rad, const Measured& measured,
                                            JointVector& wanted_rad) noexcept {
  std::uint8_t blocked = 0;
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    const auto bit = static_cast<std::uint8_t>(1u << i);
    if ((measured.fresh & bit) == 0) continue;
    const double lag_s =
        following_lag_s(drives_[static_cast<std::size_t>(i)], period_s_, measured.feedback_period_s[i]);
    const double room_rad = limits_.following_error_rad + lag_s / period_s_ * std::abs(measured.moved_rad[i]);
    const double actual_rad = measured.motor_rad[i];
    if (std::abs(motor_rad[i] - actual_rad) <= room_rad) continue;
    blocked |= bit;
    wanted_rad[i] =
        std::clamp(std::clamp(motor_rad[i], actual_rad - room_rad, actual_rad + room_rad),
                   std::min(envelope_.low_rad(i), motor_rad[i]), std::max(envelope_.high_rad(i), motor_rad[i]));
  }
  if (blocked == 0) return 0;
  active_.set(Limit::following_error, blocked);
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    if ((blocked & 1u << i) == 0) wanted_rad[i] = guard_.target_rad()[i];
  }
  return blocked;
}

// The envelope of a blocked joint isn't updated.
void AdmittanceMotion::follow_setpoints(const Measured& measured, std::uint8_t blocked) noexcept {
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    if ((blocked & 1u << i) != 0) continue;
    envelope_.step(i, guard_.target_rad()[i], period_s_,
                   following_lag_s(drives_[static_cast<std::size_t>(i)], period_s_, measured.feedback_period_s[i]));
  }
}

// The one place where setpoints become final, in every phase. Each joint's limits are applied first, then those of the
// tool and of the elbow. Returns true if the latter held something back.
bool AdmittanceMotion::make_final(const JointVector& wanted_rad, double max_speed_m_per_s) noexcept {
  active_.add(guard_.step(wanted_rad));
  const ActiveLimits held_back = tool_guard_.step(guard_.target_rad(), max_speed_m_per_s);
  if (held_back.kinds == 0) return false;
  active_.add(held_back);
  guard_.settle(tool_guard_.target_rad(), tool_guard_.speed_rad_per_s());
  return true;
}

// Filter and proxy go on from what was commanded, so motion that couldn't be followed isn't caught up later. The
// setpoint of a blocked joint may have moved fast; that joint goes on at rest.
void AdmittanceMotion::wind_back(std::uint8_t blocked) noexcept {
  const JointVector& speed = guard_.speed_rad_per_s();
  guard_.follow_from_here(blocked);
  parts_.elastic.resume(guard_.target_rad(), speed);
  state_.link_rad = parts_.elastic.link_rad() + parts_.elastic.lead_s() * speed;
  state_.link_step_rad = period_s_ * speed;
  arm_.kinematics(state_.link_rad, solution_.kinematics);
  const Vec3 velocity_W = solution_.kinematics.J_W.topRows<3>() * speed;
  const Vec3 omega_W = no_faster(solution_.kinematics.J_W.bottomRows<3>() * speed, most_turning_rad_per_s());
  const Eigen::Quaterniond R_WT = orientation_of(solution_.kinematics.X_WT);
  parts_.orientation.resume(R_WT, omega_W);
  if (pose() != nullptr) pose()->turn_to(R_WT, omega_W);
  go_on_from(solution_.kinematics.X_WT.translation(), velocity_W);
  if (pose() != nullptr) parts_.orientation.resume(pose()->orientation(), omega_W);
  state_.q_k2_W = state_.q_k1_W - period_s_ * velocity_W;
}

}  // namespace proxarm::controller
