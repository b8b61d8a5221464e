#include "controller/motion/measurement.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

// The bias follows the reading at rest with the time constant bias_s, at most at bias_N_per_s. A sensor that warms up
// drifts by 0.01 N/s. A hand whose force grows by less than 0.35 N/s counts as drift, up to max_bias_drift_N.
constexpr double bias_s = 0.35, bias_N_per_s = 0.35;
// Lever that converts the bias of a torque to a bias of a force: about a handle's length.
constexpr double bias_lever_m = 0.1;
// Largest accepted jump during the tare, a part of which enters the bias. A smaller jump moves an empty handle by 24 mm
// at most.
constexpr double least_tare_jump_N = 0.3;
// If the readings aren't white noise, their largest spread for a zero that is to be stored.
constexpr double most_kept_N = 0.3;
// Uncertainty of the tare's mean, as a multiple of the mean's standard deviation.
constexpr double tare_deviations = 4.0;
// Smallest uncertainty of the tare, even without noise: the tool's orientation is uncertain by half a milliradian,
// which changes the weight of half a kilogram by 2 mN.
constexpr double least_open_N = 2e-3;

}  // namespace

using models::JointVector;
using models::Vec3;

Measurement::Measurement(std::span<const DriveOnBus> drives, const fieldbus::ForceSensor& sensor,
                         const models::Arm& arm, const WrenchCompensation& compensation, double period_s)
    : drives_(drives), sensor_(sensor), arm_(arm), compensation_(compensation), period_s_(period_s) {
  const JointVector zero = JointVector::Zero(arm.axes());
  Measured& now = state_.measured;
  now.motor_rad = now.link_rad = now.drive_target_rad = arm.start_rad();
  now.moved_rad = now.jump_rad = now.answers.unheard_cycles = now.answers.period_s = now.gear_torque_Nm = zero;
  state_.stale_cycles = zero;
  points_.joint_W.fill(Vec3::Zero());  // an arm may have fewer joints, but all are archived
  arm.points(now.link_rad, points_);
}

void Measurement::take() noexcept {
  read_encoders();
  Measured& now = state_.measured;
  now.link_rad = now.motor_rad - (arm_.motor_from_link(now.link_rad) - now.link_rad);
  arm_.kinematics(now.link_rad, kinematics_);
  now.tool_W = kinematics_.X_WT.translation();
  now.R_WS = kinematics_.X_WS.linear();
  place_elbow();
  read_sensor();
}

// Computes elbow_moved_m from the joints whose speed the tool guard bounds (tool_guard.hpp). The places of the first
// two joints hardly move.
void Measurement::place_elbow() noexcept {
  constexpr std::size_t first_joint = 2;
  const auto before_W = points_.joint_W;
  arm_.points(state_.measured.link_rad, points_);
  double& moved_m = state_.measured.elbow_moved_m;
  moved_m = 0.0;
  for (std::size_t i = first_joint; i < static_cast<std::size_t>(arm_.axes()); ++i) {
    moved_m = std::max(moved_m, (points_.joint_W[i] - before_W[i]).norm());
  }
}

void Measurement::read_encoders() noexcept {
  Measured& now = state_.measured;
  now.fresh = now.following = 0;
  for (Eigen::Index i = 0; i < now.axes(); ++i) {
    const fieldbus::CyclicDrive& drive = drives_[static_cast<std::size_t>(i)].drive;
    const double actual_rad = drive.actual_rad();
    const double T = period_s_, share = T / (T + 2.0 * drive.feedback_period_s());
    now.jump_rad[i] = actual_rad - now.motor_rad[i];
    now.moved_rad[i] += share * (now.jump_rad[i] - now.moved_rad[i]);
    now.motor_rad[i] = actual_rad;
    now.answers.period_s[i] = drive.feedback_period_s();
    now.drive_target_rad[i] = drive.target_rad();
    if (const auto torque_Nm = drive.gear_torque_Nm()) now.gear_torque_Nm[i] = *torque_Nm;
    now.answers.unheard_cycles[i] = state_.stale_cycles[i];
    state_.stale_cycles[i] = drive.fresh() ? 0.0 : state_.stale_cycles[i] + 1.0;
    const auto bit = static_cast<std::uint8_t>(1u << i);
    if (drive.fresh()) now.fresh |= bit;
    if (drive.following()) now.following |= bit;
  }
}

void Measurement::read_sensor() noexcept {
  Measured& now = state_.measured;
  now.sample_is_new = sensor_.fresh();
  if (now.sample_is_new) {
    const fieldbus::ForceSample& sample = sensor_.latest();
    now.reading_S.force = Vec3(sample.wrench_S.data());
    now.reading_S.torque = Vec3(sample.wrench_S.data() + 3);
  }
  now.hand_W = compensation_.hand_wrench_W(now.reading_S, now.R_WS);
}

void Measurement::add_tare_sample() noexcept {
  const Measured& now = state_.measured;
  state_.tare_cycles += 1.0;
  if (now.sample_is_new) compensation_.add_tare_sample(now.reading_S, now.R_WS);
}

void Measurement::finish_tare() noexcept {
  Measured& now = state_.measured;
  compensation_.finish_tare();
  const double samples = compensation_.tare_samples();
  const double noise_N = compensation_.noise_N();
  now.bias = {.noise_N = compensation_.noise_is_white() ? noise_N : std::min(noise_N, compensation_.step_noise_N()),
              .noise_is_white = compensation_.noise_is_white(),
              .samples = samples,
              .sample_cycles = state_.tare_cycles / samples,
              .drift_N = 0.0,
              .beside_zero_S = Vec3::Zero()};
  now.hand_W = compensation_.hand_wrench_W(now.reading_S, now.R_WS);
}

bool Measurement::tare(const SessionSettings& settings, double tared_for_s, Alarm& alarm) noexcept {
  add_tare_sample();
  const double spread_N = tare_spread_N();
  if (spread_N > settings.tare_spread_N) {
    alarm.raise(Fault::force_at_start, -1, spread_N, settings.tare_spread_N);
    return false;
  }
  if (tared_for_s < settings.tare_s || compensation_.tare_samples() == 0.0) return false;
  const double jumped_N = compensation_.tare_jump_S().norm();
  if (jumped_N > least_tare_jump_N) {
    alarm.raise(Fault::force_jumped, -1, jumped_N, least_tare_jump_N);
    return false;
  }
  if (settings.only_tares && !compensation_.noise_is_white() && spread_N > most_kept_N) {
    alarm.raise(Fault::force_at_start, -1, spread_N, most_kept_N);
    return false;
  }
  finish_tare();
  const Vec3 standing_S = compensation_.bias_S().force - Vec3(settings.zero_S_N.data());
  const double limit_N = standing_limit_N(settings);
  if (std::isfinite(settings.zero_drift_N)) state_.measured.bias.beside_zero_S = standing_S;
  if (standing_S.norm() <= limit_N) return true;
  alarm.raise_standing(state_.measured.R_WS * standing_S, limit_N);
  return false;
}

// Returns the allowed difference between the tare's mean and the known zero.
double Measurement::standing_limit_N(const SessionSettings& settings) const noexcept {
  return settings.zero_drift_N + tare_error_N();
}

double Measurement::tare_error_N() const noexcept {
  return tare_deviations * compensation_.noise_N() / std::sqrt(std::max(1.0, state_.measured.bias.samples));
}

ToolEvidence Measurement::tool_evidence(const HeldTool& wanted, const SessionSettings& settings) const noexcept {
  const Measured& now = state_.measured;
  ToolEvidence seen{.hand_S = {now.R_WS.transpose() * now.hand_W.force, now.R_WS.transpose() * now.hand_W.torque},
                    .turned_S = compensation_.turned_gravity_S(now.R_WS),
                    .learnt_S = compensation_.learnt_gravity_S(),
                    .zero_off_S = compensation_.tared_S() - Vec3(settings.zero_S_N.data()),
                    .zero_limit_N = standing_limit_N(settings),
                    .open_N = std::max(least_open_N, tare_error_N())};
  const models::Wrench left = seen.change(compensation_.tool(), wanted);
  seen.hand_S.force += left.force;
  seen.hand_S.torque += left.torque;
  seen.zero_off_S -= (wanted.mass_kg - compensation_.tool().mass_kg) * seen.learnt_S;
  return seen;
}

void Measurement::start_tare() noexcept {
  compensation_.start_tare();
  state_.tare_cycles = 0.0;
}

void Measurement::follow_bias(const models::Wrench& rest_W) noexcept {
  Measured& now = state_.measured;
  const double share = period_s_ / bias_s, most_N = bias_N_per_s * period_s_;
  models::Wrench rest_S = compensation_.reading_S(rest_W, now.R_WS);
  rest_S.force *= share;
  rest_S.torque *= share;
  compensation_.follow_bias(rest_S, most_N, most_N * bias_lever_m);
  compensation_.learn_at(now.R_WS, share);
  now.bias.drift_N = compensation_.drift_N();
}

void Measurement::set_period(double period_s) noexcept {
  const double ratio = period_s_ / period_s;
  state_.measured.moved_rad /= ratio;
  state_.stale_cycles *= ratio;
  period_s_ = period_s;
}

}  // namespace proxarm::controller
