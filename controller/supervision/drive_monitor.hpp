// Compares each drive's reported position with the setpoints that it was sent. A drive that deviates is a fault.
//
// A drive that follows is within the envelope of its setpoints (setpoint_envelope.hpp). With θ what it reports, d how
// far θ is outside of that, ε = limits.following_error_rad, and while d isn't zero:
//   away    how far θ has moved away from the envelope since it left it; moving back counts against it
//   drive_deviates  away > ε for 20 ms (five cycles at least), or > 5ε, or what all joints are away makes more than
//                   5 mm at the tool. The drive goes where nobody sent it: it runs off, goes the wrong way, can't hold
//                   the arm's weight, or its encoder is off. It can't be asked to stop (stop category 0).
//   drive_blocked   |d| > ε/2 for half a second in which θ stays within ε/2 of one place: setpoints wait for it, and it
//                   doesn't come. It is jammed, doesn't heed its setpoints, or its encoder is stuck. Setpoints that
//                   the hand makes swing about it pass it again and again, for which |d| counts 50 ms longer.
// Where the joint is behind because its setpoints went on, away stays zero; where the setpoints stand and it goes off,
// d is what it is away. That tells both apart without the motor's torque. Times need not be of one piece: a twentieth
// of the time in which it isn't so counts against them, so that a joint that swings about its setpoints with the hand,
// as a drive of the wrong sign does, or about which they swing, is found as well.
//
// A drive that brakes by itself (it is told to switch off, or has left operation) takes no setpoints any more, so they
// are no envelope. It was within it, and at most as fast as its setpoints were within its lag τ. With ṡ the last speed
// of the setpoints and a its deceleration (6084h, which is max_acceleration_rad_per_s2), it ends within
//   [l − max(0, aτ − ṡ)²/2a,  h + max(0, aτ + ṡ)²/2a]
// which stays as it is, and is judged as above for what is `away` from it. With setpoints that stood that is aτ²/2 to
// both sides: 0.65 mrad at 30 rad/s² and 1 ms. A drive that has power and takes no setpoints yet is judged so, too.
//
// In the shipped scenes drives that follow are away by up to 0.024 mrad. At their torque's limit they lag, catch up and
// overshoot. Of 400 random sessions of the tests, with hands of up to a kilonewton, two end for that reason: one whose
// axis 5 was jammed at 0.8 rad/s for 3.4 ms and then ran past its setpoint by more than 5 mrad, and one at 4 ms in
// which a hand of 519 N made a joint oscillate by 8 mrad.
//
// A hand may be why a joint doesn't follow: if its torque about that joint, Jᵀh, holds the joint back with at least a
// tenth of the torque that the drive must have. That is J_r a, which accelerates its rotor's inertia J_r by its limit
// a. Then drive_blocked waits for five seconds instead of half a second. In the default cell this takes 174 Nm about
// the base, or 220 N at 0.8 m.
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

inline constexpr double away_at_once = 5.0;  // of following_error_rad
inline constexpr double deviates_m = 5e-3, deviates_s = 0.02, blocked_s = 0.5, held_by_hand_s = 5.0;

// The reports of one cycle; joint vectors and bits in the order of the drives.
struct DriveReports {
  const models::JointVector& reported_rad;  // by the motors' encoders
  const models::JointVector& link_rad;      // by the same encoders
  const models::JointVector& setpoint_rad;  // the last one sent to each drive
  const models::JointVector& feedback_period_s;
  std::uint8_t fresh = 0, following = 0;  // drives that have answered in this cycle, and that take setpoints
  std::uint8_t braking = 0;               // that have power, and brake by themselves or take no setpoints yet
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

  // To be called in each cycle in which drives may have power. `waits`: setpoints may be waiting for a joint (the
  // arm is rendering or being freed), so a joint that is behind is blocked.
  DriveVerdict step(const DriveReports& now, bool waits, double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    envelope_.archive(state);
  }

 private:
  struct State {
    models::JointVector last_rad;       // reported
    models::JointVector away_rad;       // with the sign of d
    models::JointVector away_s;         // for how long that is more than ε
    models::JointVector behind_s;       // for how long |d| is more than ε/2, from ...
    models::JointVector behind_at_rad;  // ... one place
    models::JointVector passing_s;      // since |d| was more than ε/2
    models::JointVector setpoint_rad;   // the one before
    models::JointVector setpoint_rad_per_s;
    std::uint8_t known = 0;    // drives that have been judged up to now
    std::uint8_t braking = 0;  // of these, those that brake
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
