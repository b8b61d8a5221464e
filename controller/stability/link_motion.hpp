// Estimates how the links swing on their gears under a hand. The encoders are on the motors, and don't see this motion.
//
// φ are the links' angles, y the links' angles at rest by the encoders, and w is the wrench at the sensor about T. M_h,
// the inertia of the part behind the sensor, is subtracted from the arm's mass, since w already includes its effect:
//   (M − Jᵀ M_h J) φ̈ = k(y − φ) + d(ẏ − φ̇) + Jᵀ w
// This is the links' equation of elastic_loop.hpp, with measured motor angles and forces in place of modelled ones. M,
// J and M_h belong to the present pose. Coriolis torques are left out, as in elastic_setpoint.hpp. The trapezoidal rule
// integrates the equation over one period. It neither damps nor feeds a mode, however stiff the gears are:
//   φ = φ₁ + T φ̇₁ + ¼T²(φ̈₁ + φ̈),   φ̇ = φ̇₁ + ½T(φ̈₁ + φ̈)
//   (M − Jᵀ M_h J + ½T d + ¼T² k) φ̈ = k(y − φ₁ − Tφ̇₁ − ¼T²φ̈₁) + d(ẏ − φ̇₁ − ½Tφ̈₁) + Jᵀ w
// The encoders alone don't suffice: near the arm's first mode, the links move several times as far as the motors, and
// out of phase with them.
//
// A force reading of age τ belongs to the motors' angles τ ago, so y is delayed by τ (delay.hpp). The result is the
// links' motion at the time of the force.
//
// The estimate is only as good as the known stiffness of the gears. One caller at a time; never allocates, locks or
// throws.
#pragma once

#include "controller/stability/delay.hpp"
#include "controller/stability/tool_move.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct LinkMotionConfig {
  models::JointVector stiffness, damping;  // k > 0 and d ≥ 0 of each gear, as in ElasticArm
  models::ToolInertia behind_sensor;
  double force_age_s = 0.0;  // τ; below half a period it counts as 0
};

class LinkMotion {
 public:
  // Precondition: `arm` outlives this object.
  LinkMotion(const models::Arm& arm, const LinkMotionConfig& config, double period_s);

  // Precondition: called before start().
  void set_period(double period_s) noexcept;
  // Sets the part behind the sensor. Precondition: the arm's model includes this part, too.
  void hang(const models::ToolInertia& behind) noexcept { config_.behind_sensor = behind; }
  // Starts at rest, at the encoders' angles.
  void start(const models::JointVector& resting_rad) noexcept;
  // Advances by one period and returns the tool's motion. If a value isn't finite, nothing changes, and the motion is
  // zero.
  ToolMove step(const models::JointVector& resting_rad, const models::Wrench& wrench_W) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  [[nodiscard]] models::JointMatrix mass(const models::ToolKinematics& at) const noexcept;

  const models::Arm* arm_;
  LinkMotionConfig config_;
  double period_s_ = 0.0;
  Delay<models::JointVector> delay_;
  models::JointVector resting_rad_;                       // the last y, before the delay
  models::JointVector delayed_rad_;                       // the last y, after the delay
  models::JointVector angle_rad_, speed_, acceleration_;  // φ, φ̇, φ̈
};

}  // namespace proxarm::controller
