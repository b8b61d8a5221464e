#include "controller/extras/identification/joints/link_response.hpp"

#include <Eigen/LU>

#include "models/arm/tool_inertia.hpp"

namespace proxarm::identification {
namespace {

using models::JointVector;
using models::Mat3;
using models::Vec3;

Eigen::MatrixXd gravity_stiffness(const models::Arm& arm, const JointVector& link_rad) {
  constexpr double step_rad = 1e-4;
  Eigen::MatrixXd G(arm.axes(), arm.axes());
  for (int joint = 0; joint < arm.axes(); ++joint) {
    JointVector low = link_rad, high = link_rad;
    low[joint] -= step_rad;
    high[joint] += step_rad;
    G.col(joint) = (arm.gravity_torque(high) - arm.gravity_torque(low)) / (2.0 * step_rad);
  }
  return G;
}

}  // namespace

LinkResponse::LinkResponse(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad,
                           double inertia_share) {
  const JointVector link_rad = arm.link_from_motor(motor_rad);
  mass_ = inertia_share * arm.link_mass_matrix(link_rad);
  gravity_ = inertia_share * gravity_stiffness(arm, link_rad);
  models::ToolKinematics at;
  arm.kinematics(link_rad, at);
  const Mat3 R_SW = at.X_WS.linear().transpose();
  const Vec3 c_S(cell.tool.centre_of_mass_S_m.data()), g_W(cell.gravity_W_m_per_s2.data());
  const Vec3 from_T_W = at.X_WS * c_S - at.X_WT.translation();
  const double m = cell.tool.mass_kg;
  per_acceleration_.resize(6, arm.axes());
  per_angle_.resize(6, arm.axes());
  for (int joint = 0; joint < arm.axes(); ++joint) {
    const Vec3 turn_W = at.J_W.col(joint).tail<3>();
    const Vec3 centre_W = at.J_W.col(joint).head<3>() + turn_W.cross(from_T_W);
    const Vec3 force_a = -m * (R_SW * centre_W), force_q = -m * (R_SW * turn_W.cross(g_W));
    per_acceleration_.col(joint) << force_a,
        c_S.cross(force_a) - models::inertia_about_centre_S(cell.tool) * (R_SW * turn_W);
    per_angle_.col(joint) << force_q, c_S.cross(force_q);
  }
}

ComplexJoints LinkResponse::links(const Gears& gears, double omega, const ComplexJoints& motors) const {
  const std::complex<double> i(0.0, 1.0);
  const ComplexJoints gear = gears.stiffness_Nm_per_rad + i * omega * gears.damping_Nms_per_rad;
  const Eigen::MatrixXd mass = gears.inertia_root.asDiagonal() * mass_ * gears.inertia_root.asDiagonal();
  Eigen::MatrixXcd A = (gravity_ - omega * omega * mass).cast<std::complex<double>>();
  A.diagonal() += gear;
  return A.partialPivLu().solve(ComplexJoints(gear.cwiseProduct(motors)));
}

ComplexJoints LinkResponse::gear_torques(double omega, const ComplexJoints& links) const {
  return (gravity_ - omega * omega * mass_) * links;
}

ComplexWrench LinkResponse::reading(double omega, const ComplexJoints& links) const {
  return (per_angle_ - omega * omega * per_acceleration_) * links;
}

}  // namespace proxarm::identification
