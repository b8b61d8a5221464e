// Makes the last check of where and how fast setpoints move the tool, independent of all stages before it.
//
// A setpoint θ is checked as if the arm were at rest at θ, with gears that only gravity twists: θ = q + K⁻¹τ_g(q). p(θ)
// is the place of T, or of a joint from the third on (elbow and wrist), by exact kinematics. θ₁ is the last setpoint.
// Bounds:
//   speed         |p(θ) − p(θ₁)| ≤ vT; v = limits.max_tool_speed_m_per_s for T, max_elbow_speed_m_per_s for joints
//   borders       T is within limits.workspace_m and outside limits.keep_out_m, also between two setpoints
//   turning       angle from the start, tilt, twist and turning speed, if the tool turns
//   ranges        The joint guard keeps wanted setpoints within the joints' ranges; this guard keeps only the setpoints
//                 of its own braking within them.
//
// Borders apply to the links. Motors that accelerate links lead the links by K⁻¹Mq̈_f (elastic_setpoint.hpp), a
// millimetre at 10 m/s². So p(θ) may be beyond a border while the tool isn't. For borders, p(θ) is therefore corrected
// by its difference from the tool's place at the filter's output, up to `most_lead_m` along each axis.
//
// The bounds must also hold on the way to rest. From θ, with the speed u = (θ − θ₁)/T, all joints brake together along
// u, in the time t that the slowest joint needs at its maximum deceleration:
//   θ_b = θ + (1 − T/t)uT, the first setpoint of braking,   t = max_i |u_i|/a_i
// If a wanted setpoint breaks a bound, the guard takes another one on the straight line (in joint space) from θ_b to
// the wanted setpoint: by bisection, the last one that keeps all bounds. θ_b itself always keeps them:
//   1. An arm at rest keeps all bounds.
//   2. A setpoint is accepted only if its way to rest keeps all bounds, and θ_b is on this way.
//
// The way to rest is checked by bounds of the path, not point by point:
//   1. V = |p(θ) − p(θ₁)|/T, and B = t |u|ᵀC|u| with C of Arm::path_curvature().
//   2. When the share y of the time t has passed, the speed of p is at most (1 − y)(V + yB).
//   3. The maximum of this bound is V if B ≤ V, otherwise (V + B)²/4B.
//   4. The path deviates from its chord by at most |D|ᵀC|D|/8, where D is the way to rest in joint space.
//
// A wanted setpoint within all bounds passes to the bit. An arm that starts beyond a border may move, but not further
// out. Nothing allocates, locks or throws.
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
  // Makes the setpoints of one period. Returns the active limits.
  // wanted_rad: precondition: finite and within the joints' limits (JointGuard).
  // max_speed_m_per_s: the tool's present speed limit; acts if it is below the cell's limit.
  // links_W: the tool's place at the setpoint filter's output; null: the motors' lead is unchanged.
  // turn: limits of turning; null: turning isn't checked.
  ActiveLimits step(const models::JointVector& wanted_rad, double max_speed_m_per_s, const models::Vec3* links_W,
                    const TurnSets* turn) noexcept;

  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return target_rad_; }
  [[nodiscard]] const models::JointVector& speed_rad_per_s() const noexcept { return speed_rad_per_s_; }
  // The arm's points, as if the arm were at rest at the last setpoint.
  [[nodiscard]] const models::ArmPoints& points() const noexcept { return points_; }
  // Number of setpoints near a bound, for which the quick test didn't suffice.
  [[nodiscard]] std::uint64_t judged_exactly() const noexcept { return judged_exactly_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t first_joint = 2;  // first joint whose place has a speed limit; the first two hardly move

  enum class Care : std::uint8_t { quick, exact };
  struct Limits {
    double tool_m_per_s, elbow_m_per_s;
    const TurnSets* turn;  // null: turning isn't checked
    // The tool's orientation at the last setpoint, if turning is checked.
    Eigen::Quaterniond from = Eigen::Quaterniond::Identity();
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
  models::ArmPoints points_;                    // the arm's points at target_rad_
  models::Vec3 lead_W_ = models::Vec3::Zero();  // correction of p(θ) for the motors' lead over the links
  std::uint64_t judged_exactly_ = 0;
};

}  // namespace proxarm::controller
