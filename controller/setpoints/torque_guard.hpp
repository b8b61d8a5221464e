// Whether drives have the torque for what the tool's guard (tool_guard.hpp) lets through, where the cell says what they
// have (drives[].max_torque_Nm).
//
// `max_acceleration_rad_per_s2` is one number for all poses. What a drive has depends on them: with M the arm's mass
// matrix, rotors included, and g its weight's torques, both where the last setpoint was, setpoints of speed u after u₁
// ask the drives for
//   τ = M a + g,   a = (u − u₁)/T,   and what the drives have is   |τ_i| ≤ τ_max,i
// At full stretch axis 2 of the default cell has 10 rad/s² left of its 30: it lagged, and caught up at up to 2.4 times
// the tool's speed limit.
//
// In ordinary motion the filter of the setpoints is ahead of this, and what it leaves is peaks of milliseconds, as at
// each contact, which gears and drives take without harm (a hundredth of a milliradian). There nothing is judged: held
// back, such a peak has the proxy stand in what it touches. Where setpoints are strained, at the end of the arm's reach
// or after the guard has held one back, they may be cut from cycle to cycle; then each of them is judged by itself, by
// a share of the torque, and so is braking:
//   t ≥ max_i |(M u)_i| / (share τ_max,i − |g_i|)
// Without the filter of the setpoints ahead of it, a cut setpoint makes the gears ring: a tool that is accelerated by b
// swings beyond its speed by b/ω. From the speed at which torque was short, it gets faster by eased_m_per_s2 only.
//
// Neither allocates, locks nor throws. A cell without ratings has none of it.
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
  // `arm` must outlive this.
  TorqueGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
              double max_speed_m_per_s, double period_s);

  [[nodiscard]] bool rated() const noexcept { return rated_; }
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // At rest at these angles of the links.
  void start(const models::JointVector& link_rad) noexcept;
  [[nodiscard]] bool strained() const noexcept { return state_.strained_s > 0.0; }
  // A period begins.
  void step() noexcept;
  // Setpoints may be cut: from now on each is judged by itself, for a tenth of a second.
  void strain() noexcept;
  // Nothing of what was is counted.
  void relax() noexcept;

  // The drives whose torque doesn't do for these speeds after those, as Limit::joint_torque.
  void judge(const models::JointVector& u, const models::JointVector& u_k1, ActiveLimits& out) const noexcept;
  // How long all joints together must take to rest from these speeds; 0: their accelerations alone decide.
  [[nodiscard]] double stop_s(const models::JointVector& u) const noexcept;
  // Setpoints were let through; the links are there now.
  void accept(const models::JointVector& link_rad) noexcept;
  // Torque was short at this speed of the tool.
  void ease_from(double speed_m_per_s) noexcept;
  // What the tool may do after that.
  [[nodiscard]] double eased_m_per_s() const noexcept { return state_.eased_m_per_s; }

  void archive(fieldbus::StateArchive& state, const models::JointVector& link_rad) noexcept;

 private:
  struct State {
    double strained_s = 0.0;  // for how long setpoints still count as such
    double eased_m_per_s = 0.0;
  };
  void weigh() noexcept;

  const models::Arm* arm_;
  models::JointVector max_torque_Nm_;  // infinite where the cell doesn't say
  bool rated_ = false;
  double max_speed_m_per_s_, period_s_;
  State state_;
  models::JointVector link_rad_;  // where the last setpoint was
  // There, while setpoints are strained.
  models::JointMatrix mass_;
  models::JointVector gravity_Nm_;
};

}  // namespace proxarm::controller
