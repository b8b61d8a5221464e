#include "controller/supervision/drive_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace proxarm::controller {

using models::JointVector;

namespace {

constexpr double behind_share = 0.5;  // share of following_error_rad
constexpr double forgetting = 0.05;   // rate at which a counted time shrinks while its condition isn't met
// Half a period of 10 Hz. Setpoints that wait for a standing joint oscillate at 15 to 20 Hz.
constexpr double passing_s = 0.05;
constexpr int fewest_cycles = 5;  // fewest cycles with a drive away: in a single cycle, a frame may be late
// Share of J_r a, the torque with which every drive can accelerate its rotor.
constexpr double holding_share = 0.1;

double counted(double time_s, bool is_so, double period_s) noexcept {
  return std::max(0.0, time_s + (is_so ? period_s : -forgetting * period_s));
}

}  // namespace

DriveMonitor::DriveMonitor(const models::Arm& arm, std::vector<description::DriveDescription> drives,
                           double following_error_rad)
    : arm_(arm), drives_(std::move(drives)), following_error_rad_(following_error_rad) {
  const JointVector zero = JointVector::Zero(arm.axes());
  state_.last_rad = state_.away_rad = state_.away_s = state_.behind_s = state_.behind_at_rad = state_.passing_s = zero;
  state_.setpoint_rad = state_.setpoint_rad_per_s = zero;
  envelope_.start(arm.start_rad());
}

DriveVerdict DriveMonitor::step(const DriveReports& now, bool waits, double period_s) noexcept {
  for (Eigen::Index i = 0; i < now.reported_rad.size(); ++i) {
    const auto bit = static_cast<std::uint8_t>(1u << i);
    if (((now.following | now.braking) & bit) == 0) {
      state_.known &= static_cast<std::uint8_t>(~bit);
      state_.away_rad[i] = state_.behind_s[i] = 0.0;
      continue;
    }
    if ((state_.known & bit) == 0) begin(i, now);
    state_.known |= bit;
    if ((now.braking & bit) != 0) {
      brake(i, now, period_s);
    } else {
      follow(i, now, period_s);
    }
    if ((now.fresh & bit) != 0) watch(i, now, waits && (now.braking & bit) == 0, period_s);
  }
  const DriveVerdict away = judge_away(now, period_s);
  return away.fault != Fault::none ? away : judge_behind(now);
}

double DriveMonitor::lag_s(Eigen::Index i, const DriveReports& now, double period_s) const noexcept {
  return following_lag_s(drives_[static_cast<std::size_t>(i)], period_s, now.feedback_period_s[i]);
}

void DriveMonitor::follow(Eigen::Index i, const DriveReports& now, double period_s) noexcept {
  const auto bit = static_cast<std::uint8_t>(1u << i);
  if ((state_.braking & bit) != 0) begin(i, now);
  state_.braking &= static_cast<std::uint8_t>(~bit);
  const double before_rad = std::exchange(state_.setpoint_rad[i], now.setpoint_rad[i]);
  state_.setpoint_rad_per_s[i] = (now.setpoint_rad[i] - before_rad) / period_s;
  envelope_.step(i, now.setpoint_rad[i], period_s, lag_s(i, now, period_s));
}

// In the first cycle of braking, widens the envelope to the interval in which the drive stops. It then stays constant.
void DriveMonitor::brake(Eigen::Index i, const DriveReports& now, double period_s) noexcept {
  const auto bit = static_cast<std::uint8_t>(1u << i);
  if ((state_.braking & bit) != 0) return;
  state_.braking |= bit;
  const double a = drives_[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2;
  const double lags = a * lag_s(i, now, period_s), speed = state_.setpoint_rad_per_s[i];
  const double down = std::max(0.0, lags - speed), up = std::max(0.0, lags + speed);
  envelope_.widen(i, down * down / (2.0 * a), up * up / (2.0 * a));
}

// Begins to judge a drive. The envelope begins at the setpoint. If the drive takes no setpoints yet, the envelope
// begins at its reported position, at which it should stay.
void DriveMonitor::begin(Eigen::Index i, const DriveReports& now) noexcept {
  const auto bit = static_cast<std::uint8_t>(1u << i);
  const double from_rad = (now.following & bit) != 0 ? now.setpoint_rad[i] : now.reported_rad[i];
  envelope_.start(i, from_rad);
  state_.braking &= static_cast<std::uint8_t>(~bit);
  state_.setpoint_rad[i] = from_rad;
  state_.setpoint_rad_per_s[i] = 0.0;
  state_.last_rad[i] = state_.behind_at_rad[i] = now.reported_rad[i];
  state_.away_rad[i] = state_.away_s[i] = state_.behind_s[i] = 0.0;
  state_.passing_s[i] = passing_s;
}

// Updates `away` and the counted times. `away` is at most d, so motion within the envelope doesn't count.
void DriveMonitor::watch(Eigen::Index i, const DriveReports& now, bool waits, double period_s) noexcept {
  const double theta = now.reported_rad[i], d = envelope_.outside_rad(i, theta);
  const double moved = theta - std::exchange(state_.last_rad[i], theta), away = state_.away_rad[i] + moved;
  state_.away_rad[i] = d > 0.0 ? std::clamp(away, 0.0, d) : std::clamp(away, d, 0.0);
  state_.away_s[i] = counted(state_.away_s[i], std::abs(state_.away_rad[i]) > following_error_rad_, period_s);

  const double least = behind_share * following_error_rad_;
  double &behind_s = state_.behind_s[i], &at = state_.behind_at_rad[i];
  const bool moves = std::abs(theta - at) > least;
  if (moves) at = theta;
  double& since_s = state_.passing_s[i];
  since_s = std::abs(d) > least ? 0.0 : since_s + period_s;
  behind_s = moves || !waits ? 0.0 : counted(behind_s, since_s < passing_s, period_s);
}

DriveVerdict DriveMonitor::judge_away(const DriveReports& now, double period_s) noexcept {
  Eigen::Index furthest = 0;
  const double most = state_.away_rad.cwiseAbs().maxCoeff(&furthest), limit = following_error_rad_;
  if (!(most > limit)) return {};
  const DriveVerdict deviates{Fault::drive_deviates, static_cast<int>(furthest), most, limit};
  const double patience_s = std::max(deviates_s, fewest_cycles * period_s);
  if (most > away_at_once * limit || state_.away_s[furthest] > patience_s) return deviates;
  arm_.kinematics(now.link_rad, kinematics_);
  return (kinematics_.J_W.topRows<3>() * state_.away_rad).norm() > deviates_m ? deviates : DriveVerdict{};
}

DriveVerdict DriveMonitor::judge_behind(const DriveReports& now) noexcept {
  for (Eigen::Index i = 0; i < state_.behind_s.size(); ++i) {
    if (state_.behind_s[i] <= blocked_s) continue;
    if (state_.behind_s[i] <= held_by_hand_s && held_by_hand(i, now)) continue;
    const double d = envelope_.outside_rad(i, now.reported_rad[i]);
    return {Fault::drive_blocked, static_cast<int>(i), std::abs(d), behind_share * following_error_rad_};
  }
  return {};
}

bool DriveMonitor::held_by_hand(Eigen::Index i, const DriveReports& now) noexcept {
  arm_.kinematics(now.link_rad, kinematics_);
  const auto lever = kinematics_.J_W.col(i);
  const double torque = lever.head<3>().dot(now.hand_W.force) + lever.tail<3>().dot(now.hand_W.torque);
  const description::DriveDescription& drive = drives_[static_cast<std::size_t>(i)];
  const double enough = holding_share * drive.rotor_inertia_kg_m2 * drive.max_acceleration_rad_per_s2;
  const double back = envelope_.outside_rad(i, now.reported_rad[i]) > 0.0 ? torque : -torque;
  return back > 0.0 && back >= enough;
}

}  // namespace proxarm::controller
