#include "controller/rendering/rendered_tool.hpp"

namespace proxarm::controller {

using models::Vec3;

// The torque is zero with the default damping, since J/D then equals TurnSets::braking_s.
Vec3 RenderedTool::braking_torque_W() const noexcept {
  const double wanted = inertia_kg_m2() / TurnSets::braking_s, damping = turning_damping_Nms_per_rad();
  if (!(wanted > damping)) return Vec3::Zero();
  return -(wanted - damping) * omega_W();
}

// ---- a point

void PointTool::start(const Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept {
  world_->start(q_W);
  orientation_.start(R_WT);
}

WorldStep PointTool::step(const Vec3& h_W, const StepLimits& limits) noexcept {
  WorldStep step = world_->step(h_W, limits);
  step.limit_torque_W = orientation_.limit_torque_W();
  if (step.fault == ProxyFault::none) step.fault = turned_;
  return step;
}

Vec3 PointTool::turn_on(const Eigen::Quaterniond& R_WT, const Vec3& omega_W, const Vec3& q_W,
                        const Vec3& /*v_W*/) noexcept {
  orientation_.resume(R_WT, omega_W);
  return q_W;
}

void PointTool::set(const Change& change) noexcept {
  world_->set(change);
  if (change.parameter == Parameter::inertia) orientation_.set_inertia(change.value, behind_sensor_T_);
  if (change.parameter == Parameter::turning_damping) orientation_.set_damping(change.value);
  if (change.parameter == Parameter::turning_spring) orientation_.set_spring(change.value);
}

// If the session has no inertia setting, the tool's inertia isn't subtracted.
void PointTool::hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept {
  world_->set({.parameter = Parameter::mass, .value = proxy_mass_kg});
  behind_sensor_T_ = behind.about_T_kg_m2;
  const OrientationConfig& turning = orientation_.config();
  if (!turning.behind_sensor_T.isZero(0.0)) orientation_.set_inertia(turning.inertia_kg_m2, behind_sensor_T_);
}

void PointTool::set_period(double period_s) noexcept {
  world_->set_period(period_s);
  orientation_.set_period(period_s);
}

void PointTool::archive(fieldbus::StateArchive& state) noexcept {
  world_->archive(state);
  state(orientation_, behind_sensor_T_);
}

// ---- a tool with a shape

void RigidTool::start(const Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept {
  pose_->turn_to(R_WT, Vec3::Zero());
  pose_->start(q_W);
}

Vec3 RigidTool::resume(const Vec3& q_W, const Vec3& v_W) noexcept {
  pose_->turn_to(pose_->orientation(), pose_->angular_velocity_W());
  return pose_->resume(q_W, v_W);
}

Vec3 RigidTool::turn_on(const Eigen::Quaterniond& R_WT, const Vec3& omega_W, const Vec3& q_W,
                        const Vec3& v_W) noexcept {
  pose_->turn_to(R_WT, omega_W);
  return pose_->resume(q_W, v_W);
}

}  // namespace proxarm::controller
