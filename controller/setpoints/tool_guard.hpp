// The last word on where and how fast the tool is told to go, whatever joints, singularities and layers above make of
// it.
//
// A setpoint θ stands for where the arm is when it rests there, its gears twisted by gravity alone: θ = q + K⁻¹τ_g(q).
// With p(θ) the place of T, or of one of the joints from the third on (elbow and wrist), by exact kinematics of each
// setpoint, never by a Jacobian:
//   speed         |p(θ) − p(θ₁)| ≤ vT, v = limits.max_tool_speed_m_per_s of T, max_elbow_speed_m_per_s of the joints
//
//   acceleration  |p(θ) − 2p(θ₁) + p(θ₂)| ≤ 2aT² where it gets faster, a = limits.max_tool_acceleration_m_per_s2
//
//   borders       T within limits.workspace_m and out of limits.keep_out_m, and on the way between two setpoints
//   ranges        of the joints
// and all of it (but the acceleration) on the way to rest, too: from θ, with the speed u = (θ − θ₁)/T, all joints brake
// together along u, the one that takes longest at its own deceleration:
//   θ_b = θ + (1 − T/t)uT and so on,   t = max_i |u_i|/a_i
// or longer, where the cell rates the drives' torques (torque_guard.hpp), which bound the way from θ₁ to θ as well.
// Such a braking never has to be judged when it is needed: it was, when the setpoint before was let through. So where
// what is wanted breaks a bound, the setpoint lies on the straight line (in the joints) from θ_b to what is wanted, as
// far along as bisection finds all bounds kept; θ_b itself always keeps them, by induction from rest.
//
// How the way to rest is judged without walking it. With C of Arm::path_curvature(), at a share y of the time t it
// takes, p is no faster than (1 − y)(V + yB),  V = |p(θ) − p(θ₁)|/T,  B = t |u|ᵀC|u|: V where B ≤ V, (V + B)²/4B else.
// And it bends by no more than |D|ᵀC|D|/8 from the chord, D the way to rest.
//
// What is wanted passes unchanged, to the bit, where no bound is touched. Whoever starts outside of a border may move,
// but not further out. The acceleration counts twice its limit: motors must accelerate more than the links that they
// bend their gears for, by up to a quarter in ordinary contact. Neither allocates, locks nor throws.
#pragma once

#include <array>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/setpoints/torque_guard.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class ToolGuard {
 public:
  // `arm` must outlive this.
  ToolGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
            const description::CellLimits& limits, double period_s);

  // Precondition: at rest.
  void set_period(double period_s) noexcept {
    period_s_ = period_s;
    torques_.set_period(period_s);
  }
  // At rest there.
  void start(const models::JointVector& target_rad) noexcept;
  // One period. Precondition: `wanted_rad` is finite and within each joint's own limits (JointGuard). `max_speed`: of
  // T, where it is lower than the cell's for now. Returns what held something back.
  ActiveLimits step(const models::JointVector& wanted_rad, double max_speed_m_per_s) noexcept;

  // The arm is at the end of its reach: what is wanted may be cut from cycle to cycle (torque_guard.hpp).
  void strain() noexcept { torques_.strain(); }
  // A drive is blocked: what its setpoints ask for isn't what it takes to move the arm.
  void relax() noexcept { torques_.relax(); }

  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return target_rad_; }
  [[nodiscard]] const models::JointVector& speed_rad_per_s() const noexcept { return speed_rad_per_s_; }
  // Where the arm rests at the last setpoint.
  [[nodiscard]] const models::ArmPoints& points() const noexcept { return points_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t first_joint = 2;  // of those whose speed is limited; the first two hardly move
  using Steps = std::array<models::Vec3, 1 + models::max_axes>;

  enum class Care : std::uint8_t { quick, exact };
  struct Speeds {
    double tool_m_per_s, elbow_m_per_s;
  };

  void evaluate(const models::JointVector& theta, int rounds, models::ArmPoints& out) const noexcept;
  [[nodiscard]] double stop_s(const models::JointVector& u) const noexcept;
  [[nodiscard]] double bend(const models::JointVector& d) const noexcept;
  [[nodiscard]] models::JointVector braking_way(const models::JointVector& u, double t) const noexcept;
  [[nodiscard]] ActiveLimits broken(const models::JointVector& theta, const models::ArmPoints& at, const Speeds& limit,
                                    Care care) const noexcept;
  void judge_ranges(const models::JointVector& rest, ActiveLimits& out) const noexcept;
  void judge_motion(const models::ArmPoints& at, double growth, const Speeds& limit, Care care,
                    ActiveLimits& out) const noexcept;
  [[nodiscard]] bool far_from_borders(const models::Vec3& p, double way_m) const noexcept;
  void judge_borders(const models::Vec3& p, const models::Vec3& rest_p, double step_bend, double rest_bend,
                     ActiveLimits& out) const noexcept;
  void hold_back(const models::JointVector& wanted, const Speeds& limit, ActiveLimits& out) noexcept;
  [[nodiscard]] bool folds() const noexcept;
  [[nodiscard]] bool stretched() const noexcept;
  void accept(const models::JointVector& theta, const models::ArmPoints& at) noexcept;

  const models::Arm* arm_;
  models::JointVector lower_rad_, upper_rad_, acceleration_;
  models::JointMatrix curvature_;
  description::CellLimits limits_;
  bool has_borders_;
  double period_s_;
  TorqueGuard torques_;

  models::JointVector target_rad_, speed_rad_per_s_, twist_k2_rad_;
  models::ArmPoints points_;   // at target_rad_
  Steps steps_{};              // of the points, in the last period
  double brakes_for_s_ = 0.0;  // as long as the braking that was judged when target_rad_ was let through
};

}  // namespace proxarm::controller
