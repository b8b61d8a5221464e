// Whether the drives have the torque for what the tool's guard (tool_guard.hpp) accepts, if the cell rates their
// torques (drives[].max_torque_Nm).
//
// `max_acceleration_rad_per_s2` is one number for all poses, but the acceleration that a drive's torque allows depends
// on the pose. Let M be the arm's mass matrix, rotors included, and g the torques of its weight, both at the last
// setpoint. Setpoints of speed u after u₁ ask the drives for τ, which is bounded by their ratings:
//   τ = M a + g,   a = (u − u₁)/T,   |τ_i| ≤ τ_max,i
// At full stretch, axis 2 of the default cell can do 10 rad/s² instead of its 30. Without this guard it lagged, and
// caught up at up to 2.4 times the tool's speed limit.
//
// In ordinary motion the filter of the setpoints smooths them before. What it leaves are torque peaks of milliseconds,
// as at each contact, which gears and drives take without harm (a hundredth of a milliradian). They aren't judged: if
// such a peak were held back, the proxy would stop inside what it touches. Setpoints are strained at the end of the
// arm's reach and after the tool's guard has held one back, since they may be cut from cycle to cycle there. Then each
// of them is judged by itself, by a share of the torque, and so is braking:
//   t ≥ max_i |(M u)_i| / (share τ_max,i − |g_i|)
// A setpoint that is cut hasn't passed the filter, so it makes the gears oscillate: a tool that is accelerated by b
// overshoots its speed by b/ω. From the speed at which torque was short, the tool therefore gets faster by
// eased_m_per_s2 only.
//
// Neither allocates, locks nor throws. Without ratings in the cell, nothing is judged.
#pragma once

#include <vector>

#include "controller/limits/step_limits.hpp"
#include "models/arm/arm.hpp"
#include "models/base/archive_fields.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class TorqueGuard {
 public:
  // Precondition: `arm` outlives this object.
  TorqueGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
              double max_speed_m_per_s, double period_s);

  [[nodiscard]] bool rated() const noexcept { return rated_; }
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Starts at rest at these angles of the links.
  void start(const models::JointVector& link_rad) noexcept;
  [[nodiscard]] bool strained() const noexcept { return state_.strained_s > 0.0; }
  // Begins a period.
  void step() noexcept;
  // Setpoints may be cut: each is judged by itself for the next tenth of a second.
  void strain() noexcept;
  // Forgets strain and easing.
  void relax() noexcept;

  // Sets Limit::joint_torque for the drives whose torque doesn't suffice for the speeds u after u_k1.
  void judge(const models::JointVector& u, const models::JointVector& u_k1, ActiveLimits& out) const noexcept;
  // The least time in which all joints together can brake from these speeds; 0 if only their accelerations limit it.
  [[nodiscard]] double stop_s(const models::JointVector& u) const noexcept;
  // Setpoints were accepted; the links are at these angles.
  void accept(const models::JointVector& link_rad) noexcept;
  // Torque was short at this speed of the tool.
  void ease_from(double speed_m_per_s) noexcept;
  // The tool's speed limit after that.
  [[nodiscard]] double eased_m_per_s() const noexcept { return state_.eased_m_per_s; }

  void archive(fieldbus::StateArchive& state, const models::JointVector& link_rad) noexcept;

 private:
  struct State {
    double strained_s = 0.0;  // remaining time of strain
    double eased_m_per_s = 0.0;
  };
  void weigh() noexcept;

  const models::Arm* arm_;
  models::JointVector max_torque_Nm_;  // infinite if the cell doesn't rate it
  bool rated_ = false;
  double max_speed_m_per_s_, period_s_;
  State state_;
  models::JointVector link_rad_;  // of the last setpoint
  // At link_rad_; kept only while setpoints are strained.
  models::JointMatrix mass_;
  models::JointVector gravity_Nm_;
};

}  // namespace proxarm::controller
