#include "controller/motion/admittance_motion.hpp"

#include <algorithm>
#include <cmath>

#include "controller/setpoints/setpoint_envelope.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

// Tolerance of the leash. Each step keeps the proxy within the leash to 1e-9 m or better.
constexpr double leash_tolerance_m = 1e-6;
// Highest rate of change of the tool's speed limit. A quarter of the cell's acceleration limit is another bound of this
// rate, so that the sets of speed and acceleration always intersect.
constexpr double speed_limit_m_per_s2 = 1.0;
// If the tool has touched nothing, a hand's force above this value gives the direction of a back-off.
constexpr double pinning_force_N = 5.0;
// Lever that converts a torque on the tool to a force: a handle's length.
constexpr double torque_lever_m = 0.1;
// Allowed lag of a held orientation when the joints can't turn the tool fast enough, near a wrist singularity. It is
// half of the angle that a person notices in a handle.
constexpr double held_lag_rad = 0.1;
// Places that are closer than this count as equal. It is the tolerance of the kinematics plus rounding.
constexpr double same_place_m = 2e-12;
// Orientations that differ by less count as equal. It is the tolerance of the kinematics.
constexpr double same_turn_rad = 1e-9;

Eigen::Quaterniond orientation_of(const models::Pose& X_WT) noexcept {
  return Eigen::Quaterniond(X_WT.linear()).normalized();
}

// Limits the turning speed that the proxy takes over from the arm to `most`. Joints that turn the tool faster than the
// proxy for a moment would otherwise add energy, and the arm would swing by itself.
Vec3 no_faster(const Vec3& omega_W, double most) noexcept {
  const double speed = omega_W.norm();
  return speed > most ? Vec3(most / speed * omega_W) : omega_W;
}

// Returns the delay of setpoint filter and slowest drive. The delay from the proxy to the real arm is this delay plus
// two periods less the lookahead's horizon.
double drives_lag_s(const std::vector<description::DriveDescription>& drives,
                    const description::CellLimits& limits) noexcept {
  const double filter_s =
      limits.setpoint_bandwidth_Hz > 0.0 ? 1.0 / (std::numbers::pi * limits.setpoint_bandwidth_Hz) : 0.0;
  return filter_s + slowest_drive_lag_s(drives);
}

double steel_lag_s(double drives_lag_s, double period_s, double horizon_s) noexcept {
  return std::max(0.0, drives_lag_s + 2.0 * period_s - horizon_s);
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
                                   const SessionSettings& settings, const HeldTool& tool)
    : parts_(std::move(parts)),
      arm_(arm),
      limits_(limits),
      supervision_(supervision),
      period_s_(settings.period_s),
      tool_mass_kg_(tool.mass_kg),
      drives_lag_s_(drives_lag_s(drives, limits)),
      horizon_s_(settings.horizon_s),
      hand_(supervision,
            {.tool = tool,
             .lever_m = settings.orientation == OrientationMode::free ? torque_lever_m : 0.0,
             .lag_s = steel_lag_s(drives_lag_s_, settings.period_s, settings.horizon_s),
             .always_held = settings.always_held},
            settings.period_s),
      limiter_(limits, settings.period_s),
      arm_step_(arm, parts_.inverse, drives, settings.period_s),
      final_(arm, drives, limits, settings.period_s) {
  state_.speed_limit_m_per_s = limits.max_tool_speed_m_per_s;
  // The longest time in which the tool comes to rest: the filter's delay plus the time in which the joints brake or the
  // limited acceleration stops the tool, whichever is longer.
  limits_work_.set_braking(
      parts_.elastic.filter().lead_s() +
      std::max(ArmStep::braking_s(drives), limits.max_tool_speed_m_per_s / limits.max_tool_acceleration_m_per_s2));
  const models::ToolKinematics& at = arm_step_.kinematics();
  R_TS_ = at.X_WT.linear().transpose() * at.X_WS.linear();
  if (settings.looks_ahead) {
    ahead_ = std::unique_ptr<Ahead>(new Ahead{SentPoint(limits, settings.horizon_s, settings.period_s),
                                              ArmStep(arm, parts_.inverse, drives, settings.period_s),
                                              LinkFilter(limits.setpoint_bandwidth_Hz, settings.period_s),
                                              {}});
    ahead_->proxy_filter.start(arm.start_rad());
  }
  if (settings.gear_damping_per_s > 0.0) {
    gear_damping_.emplace(arm, drives, GearDampingChoice{settings.gear_damping_per_s, settings.damped_gears},
                          settings.period_s);
  }
  if (settings.passivity != Passivity::off) {
    passivity_.emplace(
        PassivityConfig{.band = {.report_rate_Hz = settings.report_rate_Hz}, .force_age_s = settings.force_age_s},
        settings.period_s, damping_by(settings.passivity));
  }
}

// ---- beginnings and ends

// The first setpoint equals the last setpoint before start().
void AdmittanceMotion::start(const Measured& measured, Beginning beginning) noexcept {
  const JointVector target_rad = final_.target_rad();
  state_.freeing = beginning == Beginning::freeing;
  arm_step_.start(arm_.link_from_motor(target_rad));
  const models::Pose& X_WT = arm_step_.kinematics().X_WT;
  state_.q_k1_W = state_.q_k2_W = X_WT.translation();
  parts_.inverse.set_posture(arm_step_.link_rad());
  parts_.elastic.start(arm_step_.link_rad());
  if (gear_damping_) gear_damping_->start();
  final_.start(target_rad);
  if (state_.freeing) parts_.release->tool().count_from(parts_.tool->sets().home);
  tool().start(state_.q_k1_W, orientation_of(X_WT));
  if (ahead_) {
    ahead_->point.start(state_.q_k1_W);
    ahead_->proxy_step.start(arm_step_.link_rad());
    ahead_->proxy_filter.start(arm_step_.link_rad());
  }
  limits_work_.start();
  if (passivity_) passivity_->start(measured.tool_W);
  if (parts_.links) parts_.links->start(measured.link_rad);
  hand_.start();
  if (beginning == Beginning::resuming) {
    state_.speed_limit_m_per_s = std::min(state_.speed_limit_m_per_s, supervision_.release_speed_m_per_s);
  }
}

void AdmittanceMotion::stand(const Measured& measured) noexcept {
  if (!gear_damping_) return;
  const JointVector twist_rad = arm_.motor_from_link(measured.link_rad) - measured.link_rad;
  gear_damping_->stand(arm_.gear_stiffness_Nm_per_rad().cwiseProduct(twist_rad), measured.gear_torque_Nm);
}

std::optional<MissingWeight> AdmittanceMotion::missing_weight() const noexcept {
  const auto reversed = gear_damping_ ? gear_damping_->reversed() : std::nullopt;
  if (!reversed) return std::nullopt;
  return MissingWeight{reversed->joint, reversed->read_Nm - reversed->weight_Nm, std::abs(reversed->weight_Nm)};
}

void AdmittanceMotion::set_period(double period_s) noexcept {
  period_s_ = period_s;
  parts_.inverse.set_max_step(final_.max_steps_rad(period_s));
  parts_.elastic.set_period(period_s);
  if (gear_damping_) gear_damping_->set_period(period_s);
  parts_.tool->set_period(period_s);
  parts_.release->set_period(period_s);
  if (passivity_) passivity_->set_period(period_s);
  if (parts_.links) parts_.links->set_period(period_s);
  hand_.set_period(period_s, steel_lag_s(drives_lag_s_, period_s, horizon_s_));
  limiter_.set_period(period_s);
  arm_step_.set_period(period_s);
  final_.set_period(period_s);
  if (!ahead_) return;
  ahead_->point.set_period(period_s);
  ahead_->proxy_step.set_period(period_s);
  ahead_->proxy_filter.set_period(period_s);
}

// A change of mass, damping or spring moves the predicted point; the arm then moves to the new point slowly.
void AdmittanceMotion::set(const Change& change) noexcept {
  parts_.tool->set(change);
  if (!ahead_) return;
  switch (change.parameter) {
    case Parameter::lookahead:
      horizon_s_ = change.value;
      hand_.set_period(period_s_, steel_lag_s(drives_lag_s_, period_s_, horizon_s_));
      return ahead_->point.want(change.value);
    case Parameter::mass:
    case Parameter::damping:
    case Parameter::spring:
      return ahead_->point.take_up_change();
    case Parameter::friction:
    case Parameter::position:
    case Parameter::inertia:
    case Parameter::turning_damping:
    case Parameter::turning_spring:
    case Parameter::tool:
    case Parameter::none:
      return;
  }
}

void AdmittanceMotion::hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept {
  parts_.tool->hang(proxy_mass_kg, behind);
  if (ahead_) ahead_->point.take_up_change();
}

void AdmittanceMotion::carry(const HeldTool& tool, const models::ToolInertia& behind) noexcept {
  tool_mass_kg_ = tool.mass_kg;
  hand_.set_tool(tool);
  if (parts_.links) parts_.links->hang(behind);
}

void AdmittanceMotion::archive(fieldbus::StateArchive& state) noexcept {
  parts_.tool->archive(state);
  parts_.release->archive(state);
  if (passivity_) passivity_->archive(state);
  if (parts_.links) parts_.links->archive(state);
  if (ahead_) state(ahead_->point, ahead_->proxy_step, ahead_->proxy_filter);
  if (gear_damping_) gear_damping_->archive(state);
  state(parts_.elastic, hand_, arm_step_, final_, limits_work_, parts_.inverse.posture());
  archive_fields(state, state_);
}

// ---- rendering

ProxyMotion AdmittanceMotion::proxy_motion() const noexcept {
  return {.q_W = state_.q_k1_W,
          .v_W = (state_.q_k1_W - state_.q_k2_W) / period_s_,
          .mass_kg = state_.mass_kg,
          .damping_Ns_per_m = state_.damping_Ns_per_m,
          .touches = state_.touches,
          .limited = state_.limited,
          .braking_torque_W = parts_.tool->braking_torque_W()};
}

bool AdmittanceMotion::render(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  limit_speed(cycle);
  if (passivity_) observe_hand(measured);
  const models::Wrench h_W = hand_.step(cycle, proxy_motion());
  parts_.tool->turn(h_W.torque);
  make_limits(cycle);
  const Vec3 from_W = state_.q_k1_W;
  const WorldStep step = parts_.tool->step(h_W.force, step_limits_);
  if (!take(step, cycle)) return false;
  state_.mass_kg = step.mass_kg;
  state_.damping_Ns_per_m = step.damping_Ns_per_m;
  state_.touches = step.contacts > 0;
  // While the tool is being freed, its low speed is intended.
  state_.limited = step.limits.has(Limit::speed) && !state_.freeing;
  if (step.settled) state_.q_k2_W = state_.q_k1_W;
  record_world(step, cycle.record);
  if (step.contacts > 0) state_.last_normal_W = step.touches[0].normal_W;
  if (passivity_) record_passivity(step, cycle.record);
  cycle.record.set(RecordFlag::limit_orientation, parts_.tool->turning_limited());
  if (follow_proxy(cycle)) {
    judge_limits(step, from_W, cycle);
    send(measured);
  }
  count_work(step);
  const double distance_m = std::max((measured.tool_W - state_.q_k1_W).norm(), turned_away_m(measured));
  if (!(distance_m <= limits_.leash_m + leash_tolerance_m)) {
    cycle.alarm.raise(Fault::leash_exceeded, -1, distance_m, limits_.leash_m);
  }
  return true;
}

// Takes over the proxy's step. Returns false if the step has failed.
bool AdmittanceMotion::take(const WorldStep& step, const MotionCycle& cycle) noexcept {
  if (step.fault != ProxyFault::none) {
    cycle.alarm.raise(step.fault == ProxyFault::squeezed ? Fault::proxy_squeezed : Fault::proxy_not_finite);
    return false;
  }
  active_.add(step.limits);
  state_.q_k2_W = state_.q_k1_W;
  state_.q_k1_W = step.q_W;
  return true;
}

// Returns the tool's lag in turning, as a distance at the end of a handle, in m.
double AdmittanceMotion::turned_away_m(const Measured& measured) const noexcept {
  if (!parts_.tool->turns()) return 0.0;
  const Eigen::Quaterniond R_WT(models::Mat3(measured.R_WS * R_TS_.transpose()));
  return torque_lever_m * R_WT.angularDistance(parts_.tool->R_WT());
}

// Makes the sets of this step around the proxy, and with lookahead also the sets around the commanded point. With
// lookahead, the arm's filter state limits the commanded point's acceleration, and a separate filter state limits the
// proxy's acceleration.
void AdmittanceMotion::make_limits(const MotionCycle& cycle) noexcept {
  const LinkFilter& filter = parts_.elastic.filter();
  const models::ToolKinematics& filtered = parts_.elastic.kinematics();
  const JointVector twist_rad = final_.target_rad() - filter.rad();
  StepStart start{.q_k1_W = state_.q_k1_W,
                  .q_k2_W = state_.q_k2_W,
                  .filtered_W = filtered.X_WT.translation(),
                  .filtered_velocity_W = filtered.J_W.topRows<3>() * filter.rad_per_s(),
                  .measured_W = cycle.measured.tool_W,
                  .force_N = cycle.measured.hand_W.force.norm(),
                  .max_speed_m_per_s = state_.speed_limit_m_per_s};
  arm_step_.begin(arm_start(filter, twist_rad));
  if (!ahead_) return limiter_.make(start, &arm_step_, step_limits_);
  StepStart sent = start;
  sent.q_k1_W = ahead_->point.c_k1_W();
  sent.q_k2_W = ahead_->point.c_k2_W();
  limiter_.make(sent, &arm_step_, ahead_->limits);
  start.filtered_W = ahead_->point.filtered_W();
  start.filtered_velocity_W = ahead_->point.filtered_velocity_W();
  ahead_->proxy_step.begin(arm_start(ahead_->proxy_filter, twist_rad));
  limiter_.make(start, &ahead_->proxy_step, step_limits_);
}

ArmStepStart AdmittanceMotion::arm_start(const LinkFilter& filter, const JointVector& twist_rad) noexcept {
  const double share = std::min(1.0, state_.speed_limit_m_per_s / limits_.max_tool_speed_m_per_s);
  ArmStepStart start{.coasting_rad = filter.coasting_rad(),
                     .input_s2 = filter.input_s2(),
                     .twist_rad = twist_rad,
                     .tool_m_per_s = share * limits_.max_tool_speed_m_per_s,
                     .elbow_m_per_s = share * limits_.max_elbow_speed_m_per_s,
                     .R_WT = tool().R_WT(),
                     .held = !tool().turns(),
                     .touches_turning = tool().turns_in_step(),
                     .turn = tool().sets()};
  if (!start.held) return start;
  start.turn = {start.R_WT, held_lag_rad, {}, limits_.max_turning_speed_rad_per_s, period_s_};
  return start;
}

// Moves the tool's speed limit towards the limit that is wanted in this cycle. If the tool stands, a lower limit
// applies at once.
void AdmittanceMotion::limit_speed(const MotionCycle& cycle) noexcept {
  const double most = limits_.max_tool_speed_m_per_s;
  double wanted = cycle.slowed ? std::min(supervision_.slow_speed_m_per_s, most) : most;
  if (state_.freeing) wanted = std::min(parts_.release->speed_m_per_s(), wanted);
  const double step = period_s_ * std::min(speed_limit_m_per_s2, 0.25 * limits_.max_tool_acceleration_m_per_s2);
  double& limit = state_.speed_limit_m_per_s;
  limit = std::clamp(wanted, limit - step, limit + step);
  if (state_.q_k1_W == state_.q_k2_W && final_.at_rest()) limit = std::min(limit, wanted);
  tool().limit_turning(std::min(1.0, limit / most));
  cycle.record.set(RecordFlag::slowed, !state_.freeing && limit < most);
}

void AdmittanceMotion::count_work(const WorldStep& step) noexcept {
  ++work_.steps;
  work_.programs = arm_step_.programs() + (ahead_ ? ahead_->proxy_step.programs() : 0);
  if (step.limits.kinds != 0) ++work_.limited;
  work_.joint_steps += static_cast<std::uint64_t>(arm_step_.iterations());
  work_.guarded = final_.judged_exactly();
}

// Returns ρ² = felt inertia / felt mass; both include the tool behind the sensor. Returns 0 before the first step.
double AdmittanceMotion::gyration_m2() const noexcept {
  return state_.mass_kg > 0.0 ? parts_.tool->inertia_kg_m2() / (state_.mass_kg + tool_mass_kg_) : 0.0;
}

void AdmittanceMotion::observe_hand(const Measured& measured) noexcept {
  if (!parts_.links) {
    return parts_.tool->world().add_damping(passivity_->observe_hand(measured.hand_W.force, measured.tool_W));
  }
  const double rho2 = gyration_m2();
  const double added =
      passivity_->observe_hand(measured.hand_W, parts_.links->step(measured.link_rad, measured.hand_W), rho2);
  parts_.tool->world().add_damping(added);
  parts_.tool->add_turning_damping(rho2 * added);
}

void AdmittanceMotion::observe_proxy(const WorldStep& step) noexcept {
  const Vec3 force_W = step.f_W + step.limit_force_W;
  if (!parts_.links) return passivity_->observe_proxy(step.v_W, force_W, step.mass_kg, step.damping_Ns_per_m);
  const RenderedTool& turns = *parts_.tool;
  TurningPort port{.kinetic_J = turns.kinetic_J(step),
                   .damping_Ns_per_m = step.damping_Ns_per_m,
                   .turning_damping_Nms_per_rad = turns.turning_damping_Nms_per_rad()};
  port.velocity_W << step.v_W, turns.omega_W();
  port.world_W << force_W, Vec3(step.torque_W + step.limit_torque_W);
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

// Returns the part of a force that can move the tool. If the arm has few axes and its tool moves in a plane or on a
// line, the arm's structure carries the rest of the force.
Vec3 AdmittanceMotion::moving_force_W(const Vec3& force_W) const noexcept {
  const models::ToolSpace& space = parts_.inverse.space();
  return space.dimensions == 3 ? force_W : Vec3(space.projection() * force_W);
}

// The tool backs off from the object that it touched last, or along the hand's force if it has touched nothing.
bool AdmittanceMotion::prepare_freeing(const Command& command, const Measured& measured) noexcept {
  if (command.order == Order::release) {
    parts_.release->start_release();
    return true;
  }
  const Vec3 force_W = moving_force_W(measured.hand_W.force);
  Vec3 n_W = state_.last_normal_W;
  if (n_W.isZero(0.0) && force_W.norm() > pinning_force_N) n_W = force_W.normalized();
  if (n_W.isZero(0.0) || !(command.value > 0.0)) return false;
  const Vec3 start_W = arm_.tool_pose(arm_.link_from_motor(final_.target_rad())).translation();
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
  limit_speed(cycle);
  make_limits(cycle);
  const Vec3 v_W = (state_.q_k1_W - state_.q_k2_W) / period_s_;
  const Vec3 h_W = parts_.release->force_W(state_.q_k1_W, v_W, hand_W);
  const WorldStep step = tool().step(h_W, step_limits_);
  if (!take(step, cycle)) return false;
  cycle.record.p_hat_W_m = triple(step.p_hat_W);
  if (follow_proxy(cycle)) send(cycle.measured);
  return parts_.release->over(state_.q_k1_W, hand_W);
}

// ---- from the proxy to the setpoints

// Moves the arm to the proxy. With lookahead, the arm is sent to the place that the proxy would reach within the
// horizon H if it coasted. With a constant hand's force h the proxy would be ½H²h/M further. This term is left out,
// because the sensor also measures the inertial force of the hand's mass: fed back, this force would halve the horizon
// at which the arm's elastic modes stay calm (figures in docs/explanation/design.md).
bool AdmittanceMotion::follow_proxy(const MotionCycle& cycle) noexcept {
  if (tool().turns()) {
    cycle.record.proxy_inertia_kg_m2 = parts_.tool->inertia_kg_m2();
    cycle.record.proxy_turning_damping_Nms_per_rad = parts_.tool->own_turning_damping_Nms_per_rad();
  }
  const models::Mat3 R_k1_WT = arm_step_.kinematics().X_WT.linear();
  if (ahead_) {
    if (!go(ahead_->proxy_step, state_.q_k1_W, cycle)) return false;
    ahead_->proxy_filter.step(ahead_->proxy_step.link_rad());
    put_proxy_where(ahead_->proxy_step);
    SentPoint& point = ahead_->point;
    point.advance_horizon();
    point.step(state_.q_k1_W, tool().world().look_ahead(Vec3::Zero(), step_limits_, ahead_s()), ahead_->limits);
    active_.add(point.active());
    if (!go(arm_step_, point.c_k1_W(), cycle)) return false;
    point.correct(arm_step_.kinematics().X_WT.translation());
  } else {
    if (!go(arm_step_, state_.q_k1_W, cycle)) return false;
    put_proxy_where(arm_step_);
  }
  if (parts_.inverse.reaches_orientation() && arm_step_.R_WT().angularDistance(tool().R_WT()) > same_turn_rad) {
    cycle.record.set(RecordFlag::limit_orientation, true);
    if (tool().turns()) turn_on_from(arm_step_, Eigen::Quaterniond(R_k1_WT).normalized());
  }
  return true;
}

// Checks whether the limits work against the hand (limits_work.hpp). f_l is the limits' force in the proxy's step plus
// κ times the proxy's displacement by the arm's step.
void AdmittanceMotion::judge_limits(const WorldStep& step, const Vec3& from_W, const MotionCycle& cycle) noexcept {
  if (step.settled) return;
  const double T = period_s_, kappa = step.mass_kg / (T * T) + step.damping_Ns_per_m / T;
  const Vec3 way = state_.q_k1_W - from_W, omega_W = parts_.tool->omega_W();
  const Vec3 limits_W = step.limit_force_W + kappa * (state_.q_k1_W - step.q_W);
  const models::Wrench& h_W = cycle.measured.hand_W;
  const double v = way.norm() / T, omega = omega_W.norm();
  limits_work_.step(
      {.work_J = limits_W.dot(way) + T * step.limit_torque_W.dot(omega_W),
       .power_W = (h_W.force.norm() + step.f_W.norm()) * v + (h_W.torque.norm() + step.torque_W.norm()) * omega,
       .kinetic_J = 0.5 * step.mass_kg * v * v});
  cycle.record.limits_work_J = limits_work_.total_J();
  if (!limits_work_.against_the_hand()) return;
  cycle.alarm.raise(Fault::works_against_hand, -1, limits_work_.push_J(), limits_work_.allowed_J());
}

// Moves the arm to q_W with the proxy's orientation. Returns false if the pose is invalid.
bool AdmittanceMotion::go(ArmStep& step, const Vec3& q_W, const MotionCycle& cycle) noexcept {
  if (step.go(q_W, tool().R_WT()) == ArmStep::Outcome::invalid) {
    cycle.alarm.raise(Fault::singular);
    return false;
  }
  active_.add(step.active());
  return true;
}

// Moves the proxy to the arm's place if the two places differ.
void AdmittanceMotion::put_proxy_where(const ArmStep& step) noexcept {
  const Vec3& q_W = step.kinematics().X_WT.translation();
  if ((q_W - state_.q_k1_W).norm() > same_place_m) put_proxy_to(q_W, (q_W - state_.q_k2_W) / period_s_);
}

void AdmittanceMotion::put_proxy_to(const Vec3& q_W, const Vec3& velocity_W) noexcept {
  state_.q_k1_W = tool().resume(q_W, velocity_W);
}

// Returns the highest turning speed with which the proxy continues after the arm couldn't follow. It is the proxy's
// turning speed so far, but at least a quarter of the limit, since joints can't stop at once.
double AdmittanceMotion::most_turning_rad_per_s() const noexcept {
  return std::max(tool().omega_W().norm(), 0.25 * limits_.max_turning_speed_rad_per_s);
}

// Lets the proxy continue from the orientation that the arm has reached. `from`: the arm's orientation before its step.
void AdmittanceMotion::turn_on_from(const ArmStep& step, const Eigen::Quaterniond& from) noexcept {
  const Vec3 turn = models::rotation_vector(step.R_WT() * from.conjugate());
  const Vec3 omega_W = no_faster(turn / period_s_, most_turning_rad_per_s());
  state_.q_k1_W = tool().turn_on(step.R_WT(), omega_W, state_.q_k1_W, (state_.q_k1_W - state_.q_k2_W) / period_s_);
}

// Returns the limits of turning by which setpoints are judged. A lowered speed limit of the tool doesn't lower them.
TurnSets AdmittanceMotion::turn_limits() const noexcept {
  TurnSets sets = tool().sets().sent();
  sets.max_speed_rad_per_s = std::max(sets.max_speed_rad_per_s, limits_.max_turning_speed_rad_per_s);
  return sets;
}

void AdmittanceMotion::send(const Measured& measured) noexcept {
  const bool turns = tool().turns();
  const TurnSets turn = turns ? turn_limits() : TurnSets{};
  JointVector motor_rad = parts_.elastic.step(arm_step_.link_rad());
  if (gear_damping_) {
    const JointVector measured_Nm = measured.gear_torque_Nm + parts_.elastic.joint_torques_Nm(measured.hand_W);
    motor_rad += gear_damping_->step(parts_.elastic.asked_Nm(), measured_Nm);
  }
  const FinalSetpoints::Result result = final_.step(motor_rad, measured,
                                                    {.max_speed_m_per_s = state_.speed_limit_m_per_s,
                                                     .links_W = parts_.elastic.kinematics().X_WT.translation(),
                                                     .turn = turns ? &turn : nullptr});
  active_.add(result.limits);
  made_setpoints_ = true;
  if (result.guarded) ++work_.held_back;
  if (result.differs) go_on_from_setpoints(result.blocked);
}

// Lets filter, arm and proxy continue from the commanded setpoints. The setpoint of a blocked joint may have moved
// fast, so a blocked joint continues at rest.
void AdmittanceMotion::go_on_from_setpoints(std::uint8_t blocked) noexcept {
  const JointVector speed = final_.go_on_from_here(blocked);
  parts_.elastic.resume(final_.target_rad(), speed);
  if (gear_damping_) gear_damping_->start();
  const LinkFilter& filter = parts_.elastic.filter();
  arm_step_.resume(filter.rad() + filter.lead_s() * speed, period_s_ * speed);
  const models::ToolKinematics& at = arm_step_.kinematics();
  const Vec3 velocity_W = at.J_W.topRows<3>() * speed;
  const Vec3 omega_W = no_faster(at.J_W.bottomRows<3>() * speed, most_turning_rad_per_s());
  Vec3 q_W = at.X_WT.translation();
  if (ahead_) {
    ahead_->proxy_step.resume(arm_step_.link_rad() - ahead_s() * speed, period_s_ * speed);
    ahead_->proxy_filter.resume(filter.rad() - ahead_s() * speed, speed);
    // With constant joint speeds the tool moves along a curve. So the proxy is put to the place of proxy_step;
    // otherwise the next cycle would move the proxy to this place.
    const Vec3 c_W = q_W;
    q_W = ahead_->proxy_step.kinematics().X_WT.translation();
    ahead_->point.resume(c_W, q_W, velocity_W);
  }
  state_.q_k1_W = tool().resume(q_W, velocity_W, orientation_of(at.X_WT), omega_W);
  state_.q_k2_W = state_.q_k1_W - period_s_ * velocity_W;
}

}  // namespace proxarm::controller
