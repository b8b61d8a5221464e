// Detects drives that deviate: compares each drive's reported position with its setpoints.
//
// A drive that follows is within the envelope of its setpoints (setpoint_envelope.hpp). θ: reported position; d:
// distance of θ outside the envelope; ε = limits.following_error_rad. While d isn't zero:
//   away    distance that θ has moved away from the envelope since leaving it, less motion back towards it
//   drive_deviates  away > ε for 20 ms (at least five cycles), or > 5ε, or the `away` of all joints together moves the
//                   tool by more than 5 mm. The drive moves without a setpoint: it runs off, turns the wrong way, can't
//                   hold the arm's weight, or its encoder is wrong. It can't be asked to stop (stop category 0).
//   drive_blocked   |d| > ε/2 for half a second, with θ within ε/2 of one place: setpoints wait for a drive that
//                   doesn't come. It is jammed, ignores its setpoints, or its encoder is stuck. The hand's setpoints
//                   may swing about the drive and pass it repeatedly, so |d| counts for another 50 ms.
// If a joint is behind because its setpoints moved on, `away` stays zero; if the setpoints stand and the joint moves,
// `away` equals d. So the monitor tells both apart without the motor's torque. A time above may be interrupted: it
// shrinks at a twentieth of the rate while its condition isn't met. So the monitor also finds a joint that swings about
// its setpoints with the hand, as with a reversed drive, or about which the setpoints swing.
//
// A drive that brakes by itself (switched off, or out of operation enabled) takes no more setpoints, so they give no
// envelope. When braking began, the drive was within the envelope, and at most as fast as its setpoints within its lag
// τ. With ṡ the last speed of the setpoints and a the drive's deceleration (6084h, equal to
// max_acceleration_rad_per_s2), the drive stops within
//   [l − max(0, aτ − ṡ)²/2a,  h + max(0, aτ + ṡ)²/2a]
// This interval stays constant and serves as the envelope for `away`. If the setpoints stood, it extends by aτ²/2 to
// both sides: 0.65 mrad at 30 rad/s² and 1 ms. A drive that has power and takes no setpoints yet is judged in the same
// way.
//
// In the shipped scenes, drives that follow are away by up to 0.024 mrad. At their torque limit they lag, catch up and
// may overshoot by 5 to 8 mrad: this stops two of 400 random test sessions with hands of up to a kilonewton.
//
// The hand may cause a joint's lag: if its torque about the joint, Jᵀh, holds the joint back with at least a tenth of
// the drive's minimum torque J_r a, which accelerates the rotor inertia J_r by its limit a. drive_blocked then waits
// five seconds instead of half a second. In the default cell this takes 174 Nm about the base, or 220 N at 0.8 m.
//
// No allocation, lock or throw after construction.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/setpoints/setpoint_envelope.hpp"
#include "controller/supervision/fault.hpp"
#include "models/arm/arm.hpp"
#include "models/base/archive_fields.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

inline constexpr double away_at_once = 5.0;  // of following_error_rad
inline constexpr double deviates_m = 5e-3, deviates_s = 0.02, blocked_s = 0.5, held_by_hand_s = 5.0;

// Reports of one cycle; joint vectors and bits in the order of the drives.
struct DriveReports {
  const models::JointVector& reported_rad;  // by the motor encoders
  const models::JointVector& link_rad;      // by the same encoders
  const models::JointVector& setpoint_rad;  // the last one sent to each drive
  const models::JointVector& feedback_period_s;
  std::uint8_t fresh = 0, following = 0;  // drives that answered in this cycle; drives that take setpoints
  std::uint8_t braking = 0;               // drives with power that brake by themselves or take no setpoints yet
  models::Wrench hand_W;                  // about the rendered point
};

struct DriveVerdict {
  Fault fault = Fault::none;
  int joint = -1;
  double value_rad = 0.0, limit_rad = 0.0;
};

class DriveMonitor {
 public:
  // Precondition: `arm` outlives this object.
  DriveMonitor(const models::Arm& arm, std::vector<description::DriveDescription> drives, double following_error_rad);

  // Call in each cycle in which drives may have power. `waits`: setpoints may wait for a joint (rendering or freeing),
  // so a joint that is behind is blocked.
  DriveVerdict step(const DriveReports& now, bool waits, double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    envelope_.archive(state);
  }

 private:
  struct State {
    models::JointVector last_rad;       // reported
    models::JointVector away_rad;       // with the sign of d
    models::JointVector away_s;         // time with more than ε
    models::JointVector behind_s;       // time with |d| more than ε/2 ...
    models::JointVector behind_at_rad;  // ... at this place
    models::JointVector passing_s;      // time since |d| was last more than ε/2
    models::JointVector setpoint_rad;   // the previous one
    models::JointVector setpoint_rad_per_s;
    std::uint8_t known = 0;    // drives judged so far
    std::uint8_t braking = 0;  // of these, drives that brake
  };

  void begin(Eigen::Index i, const DriveReports& now) noexcept;
  void follow(Eigen::Index i, const DriveReports& now, double period_s) noexcept;
  void brake(Eigen::Index i, const DriveReports& now, double period_s) noexcept;
  [[nodiscard]] double lag_s(Eigen::Index i, const DriveReports& now, double period_s) const noexcept;
  void watch(Eigen::Index i, const DriveReports& now, bool waits, double period_s) noexcept;
  [[nodiscard]] DriveVerdict judge_away(const DriveReports& now, double period_s) noexcept;
  [[nodiscard]] DriveVerdict judge_behind(const DriveReports& now) noexcept;
  [[nodiscard]] bool held_by_hand(Eigen::Index i, const DriveReports& now) noexcept;

  const models::Arm& arm_;
  std::vector<description::DriveDescription> drives_;
  double following_error_rad_;
  models::ToolKinematics kinematics_;
  SetpointEnvelope envelope_;
  State state_;
};

}  // namespace proxarm::controller
