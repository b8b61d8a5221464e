// Final check of where and how fast setpoints move the tool, independent of all stages before.
//
// A setpoint θ stands for the arm at rest there, with gears twisted by gravity alone: θ = q + K⁻¹τ_g(q). p(θ) is the
// position of T, or of a joint from the third on (elbow and wrist), by exact kinematics. Bounds:
//   speed         |p(θ) − p(θ₁)| ≤ vT; v = limits.max_tool_speed_m_per_s for T, max_elbow_speed_m_per_s for joints
//   borders       T within limits.workspace_m and outside limits.keep_out_m, also between two setpoints
//   turning       angle from the start, tilt, twist and turning speed, if the tool turns
//   ranges        of the joints; the joint guard keeps them, and here only braking does
//
// Borders apply to the links. Motors that accelerate links lead them by K⁻¹Mq̈_f (elastic_setpoint.hpp), a millimetre
// at 10 m/s², and may be beyond a border while the tool isn't. So p(θ) is corrected by its difference from the filter's
// place, up to `most_lead_m` along each axis.
//
// The bounds must also hold on the way to rest. From θ, with the speed u = (θ − θ₁)/T, all joints brake together along
// u, in the time t that the slowest needs at its own deceleration:
//   θ_b = θ + (1 − T/t)uT and so on,   t = max_i |u_i|/a_i
// Braking was checked when the setpoint before it was accepted. So if a wanted setpoint breaks a bound, bisection finds
// the setpoint furthest along the straight line (in joint space) from θ_b to the wanted one that keeps all bounds. By
// induction from rest, θ_b always keeps them.
//
// The way to rest is checked by bounds of the path, not point by point. With C of Arm::path_curvature(),
// V = |p(θ) − p(θ₁)|/T and B = t |u|ᵀC|u|, the speed of p after the share y of the time t is at most (1 − y)(V + yB).
// Its maximum is V if B ≤ V, otherwise (V + B)²/4B. The path deviates from its chord by at most |D|ᵀC|D|/8; D: way to
// rest in joint space.
//
// A wanted setpoint within all bounds passes to the bit. An arm that starts outside a border may move, but not further
// out. Neither allocates, locks nor throws.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/proxies/turn_sets.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class ToolGuard {
 public:
  // Precondition: `arm` outlives this object.
  ToolGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
            const description::CellLimits& limits, double period_s);

  // Precondition: the arm is at rest.
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Starts at rest at these angles.
  void start(const models::JointVector& target_rad) noexcept;
  // One period. Precondition: wanted_rad is finite and within the joints' limits (JointGuard). max_speed_m_per_s: the
  // tool's present speed limit, if below the cell's. links_W: the tool by the setpoint filter; null: the motors' lead
  // is unchanged. turn: limits of turning; null: not checked. Returns the active limits.
  ActiveLimits step(const models::JointVector& wanted_rad, double max_speed_m_per_s, const models::Vec3* links_W,
                    const TurnSets* turn) noexcept;

  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return target_rad_; }
  [[nodiscard]] const models::JointVector& speed_rad_per_s() const noexcept { return speed_rad_per_s_; }
  // The arm's points, at rest at the last setpoint.
  [[nodiscard]] const models::ArmPoints& points() const noexcept { return points_; }
  // Number of setpoints near a bound, for which the quick test didn't suffice.
  [[nodiscard]] std::uint64_t judged_exactly() const noexcept { return judged_exactly_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t first_joint = 2;  // first with a speed limit; the two before it hardly move

  enum class Care : std::uint8_t { quick, exact };
  struct Limits {
    double tool_m_per_s, elbow_m_per_s;
    const TurnSets* turn;                                      // null: not checked
    Eigen::Quaterniond from = Eigen::Quaterniond::Identity();  // tool at the last setpoint, if turning is checked
  };

  void evaluate(const models::JointVector& theta, int rounds, models::ArmPoints& out) const noexcept;
  [[nodiscard]] double stop_s(const models::JointVector& u) const noexcept;
  [[nodiscard]] double bend(const models::JointVector& d) const noexcept;
  [[nodiscard]] double braking_steps(double t) const noexcept;
  [[nodiscard]] ActiveLimits broken(const models::JointVector& theta, const models::ArmPoints& at, const Limits& limit,
                                    Care care) const noexcept;
  [[nodiscard]] models::JointVector within_ranges(models::JointVector theta) const noexcept;
  void judge_motion(const models::ArmPoints& at, double growth, const Limits& limit, Care care,
                    ActiveLimits& out) const noexcept;
  void judge_turning(const models::JointVector& theta, const models::ArmPoints& at, const Limits& limit,
                     double more_steps, ActiveLimits& out) const noexcept;
  [[nodiscard]] Eigen::Quaterniond orientation(const models::JointVector& link_rad) const noexcept;
  [[nodiscard]] bool far_from_borders(const models::Vec3& p, double way_m) const noexcept;
  void judge_borders(const models::Vec3& at, const models::Vec3& rest, double step_bend, double rest_bend,
                     ActiveLimits& out) const noexcept;
  void hold_back(const models::JointVector& wanted, const Limits& limit, ActiveLimits& out) noexcept;
  void accept(const models::JointVector& theta, const models::ArmPoints& at) noexcept;

  const models::Arm* arm_;
  models::JointVector lower_rad_, upper_rad_, acceleration_;
  models::JointMatrix curvature_;
  description::CellLimits limits_;
  bool has_borders_;
  double period_s_;

  models::JointVector target_rad_, speed_rad_per_s_, twist_k2_rad_;
  models::ArmPoints points_;                    // at target_rad_
  models::Vec3 lead_W_ = models::Vec3::Zero();  // of motors over links, as above
  std::uint64_t judged_exactly_ = 0;
};

}  // namespace proxarm::controller
