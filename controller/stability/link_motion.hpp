// Estimates how the links swing on their gears under a hand; the encoders are on the motors and don't see it.
//
// φ are the links' angles, y their angles at rest by the encoders, w is the wrench at the sensor about T. M_h, what
// hangs behind the sensor, is taken off the arm's mass, since its inertia is in w:
//   (M − Jᵀ M_h J) φ̈ = k(y − φ) + d(ẏ − φ̇) + Jᵀ w
// These are the links of elastic_loop.hpp, with measured motors and forces in place of modelled ones. M, J and M_h are
// those of the present pose; Coriolis torques are left out, as in elastic_setpoint.hpp. One period by the trapezoidal
// rule, which neither damps nor feeds a mode, however stiff:
//   φ = φ₁ + T φ̇₁ + ¼T²(φ̈₁ + φ̈),   φ̇ = φ̇₁ + ½T(φ̈₁ + φ̈)
//   (M − Jᵀ M_h J + ½T d + ¼T² k) φ̈ = k(y − φ₁ − Tφ̇₁ − ¼T²φ̈₁) + d(ẏ − φ̇₁ − ½Tφ̈₁) + Jᵀ w
// The encoders alone aren't enough: near an arm's first mode the links move several times as far as the motors, and out
// of phase.
//
// A force reading of age τ belongs to the motors' angles τ ago, so y is delayed by τ (delay.hpp). The result is the
// links' motion at the time of the force.
//
// Only as good as the gears' stiffness is known. One caller at a time; never allocates, locks or throws.
#pragma once

#include "controller/stability/delay.hpp"
#include "controller/stability/tool_move.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct LinkMotionConfig {
  models::JointVector stiffness, damping;  // of each gear, as ElasticArm has them: k > 0, d ≥ 0
  models::ToolInertia behind_sensor;
  double force_age_s = 0.0;  // τ; below half a period it counts as 0
};

class LinkMotion {
 public:
  // Precondition: `arm` outlives this object.
  LinkMotion(const models::Arm& arm, const LinkMotionConfig& config, double period_s);

  // Precondition: called before start().
  void set_period(double period_s) noexcept;
  // Sets what hangs behind the sensor; the arm's model includes it, too.
  void hang(const models::ToolInertia& behind) noexcept { config_.behind_sensor = behind; }
  // Starts at rest, at the encoders' angles.
  void start(const models::JointVector& resting_rad) noexcept;
  // Steps one period and returns the tool's motion. Values that aren't finite change nothing.
  ToolMove step(const models::JointVector& resting_rad, const models::Wrench& wrench_W) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  [[nodiscard]] models::JointMatrix mass(const models::ToolKinematics& at) const noexcept;

  const models::Arm* arm_;
  LinkMotionConfig config_;
  double period_s_ = 0.0;
  Delay<models::JointVector> delay_;
  models::JointVector resting_rad_;                       // the last y, not delayed,
  models::JointVector delayed_rad_;                       // and delayed
  models::JointVector angle_rad_, speed_, acceleration_;  // φ, φ̇, φ̈
};

}  // namespace proxarm::controller
