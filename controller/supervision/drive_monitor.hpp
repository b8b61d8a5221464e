// Detects drives that deviate or are blocked: compares each drive's reported position with its setpoints.
//
// A drive that follows is within the envelope of its setpoints (setpoint_envelope.hpp). θ: the reported position. d:
// the distance of θ outside the envelope. ε = limits.following_error_rad. `away`: the distance that θ has moved away
// from the envelope since it left the envelope, less its motion back. The faults are:
//   drive_deviates  `away` exceeds ε for 20 ms (at least five cycles), or `away` exceeds 5ε, or the `away` of all
//                   joints together moves the tool by more than 5 mm. The drive moves without a setpoint: it runs off,
//                   turns the wrong way or can't hold the arm's weight, or its encoder is wrong. A setpoint can't stop
//                   such a drive, so the reaction is stop category 0.
//   drive_blocked   |d| exceeds ε/2 for half a second, while θ stays within ε/2 of one place. Setpoints wait for a
//                   drive that doesn't come: it is jammed or ignores its setpoints, or its encoder is stuck. The hand's
//                   setpoints may oscillate about the drive's position, so |d| still counts as large for 50 ms after it
//                   was last large.
// If a joint is behind because its setpoints have moved on, `away` stays zero. If the setpoints stand and the joint
// moves, `away` equals d. So the monitor tells the two faults apart without the motor's torque. The 20 ms and the half
// second may be interrupted: while its condition isn't met, the counted time shrinks at a twentieth of the rate. So the
// monitor also finds a joint of a reversed drive, which oscillates about its setpoints with the hand, and a joint about
// which the setpoints oscillate.
//
// A drive that brakes by itself (switched off, or out of operation enabled) takes no more setpoints, so the setpoints
// give no envelope. When braking began, the drive was within the envelope, and its speed was that of its setpoints to
// within aτ. τ: the drive's lag. ṡ: the last speed of the setpoints. a: the drive's deceleration (6084h, equal to
// max_acceleration_rad_per_s2). The drive stops within
//   [l − max(0, aτ − ṡ)²/2a,  h + max(0, aτ + ṡ)²/2a]
// This interval is the constant envelope for `away` while the drive brakes. If the setpoints stood, the envelope grows
// by aτ²/2 on both sides: 0.65 mrad at 30 rad/s² and 1 ms. A drive that has power but takes no setpoints yet is judged
// in the same way.
//
// In the shipped scenes, drives that follow have an `away` of up to 0.024 mrad. At their torque limit drives lag, catch
// up and may overshoot by 5 to 8 mrad: this stops two of 400 random test sessions with hands of up to a kilonewton.
//
// A hand may hold a joint back. The hand counts as the cause of the joint's lag if its torque about the joint, Jᵀh,
// points back and is at least a tenth of the torque J_r a, which accelerates the rotor inertia J_r at the limit a:
// every drive must have that torque. drive_blocked then waits five seconds instead of half a second. In the default
// cell this takes 174 Nm about the base axis, or 220 N at 0.8 m.
//
// Nothing allocates, locks or throws after construction.
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

inline constexpr double away_at_once = 5.0;  // multiple of following_error_rad
inline constexpr double deviates_m = 5e-3, deviates_s = 0.02, blocked_s = 0.5, held_by_hand_s = 5.0;

// Reports of one cycle. Joint vectors and bits are in the order of the drives.
struct DriveReports {
  const models::JointVector& reported_rad;  // motor angles by the encoders
  const models::JointVector& link_rad;      // link angles by the encoders
  const models::JointVector& setpoint_rad;  // the last setpoint sent to each drive
  const models::JointVector& feedback_period_s;
  // fresh: bits of the drives that answered in this cycle. following: bits of the drives that take setpoints.
  std::uint8_t fresh = 0, following = 0;
  std::uint8_t braking = 0;  // drives with power that brake by themselves or take no setpoints yet
  models::Wrench hand_W;     // the hand's wrench about the rendered point
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

  // Call in each cycle in which drives may have power. `waits`: setpoints may wait for a joint (in rendering and
  // freeing), so a joint that stays behind is blocked.
  DriveVerdict step(const DriveReports& now, bool waits, double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    envelope_.archive(state);
  }

 private:
  struct State {
    models::JointVector last_rad;       // reported position of the previous cycle
    models::JointVector away_rad;       // `away`, with the sign of d
    models::JointVector away_s;         // counted time with `away` above ε
    models::JointVector behind_s;       // counted time with |d| above ε/2 while θ stays at behind_at_rad
    models::JointVector behind_at_rad;  // the place at which θ stays, to within ε/2
    models::JointVector passing_s;      // time since |d| was last above ε/2
    models::JointVector setpoint_rad;   // setpoint of the previous cycle
    models::JointVector setpoint_rad_per_s;
    std::uint8_t known = 0;    // drives that are being judged
    std::uint8_t braking = 0;  // judged drives that brake by themselves
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
