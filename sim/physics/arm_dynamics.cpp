#include "sim/physics/arm_dynamics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "models/base/setup_error.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/geometry/linear_systems.hpp"
#include "sim/physics/arm_model.hpp"
#include "sim/physics/pose.hpp"

namespace proxarm::sim {
namespace {

using description::SetupError;
using models::Mat3;
using models::Pose;
using models::Vec3;
using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using MujocoJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, models::most_rows>;

// Mechanical end stops are this far beyond the URDF's limits (3 degrees), so that software limits act before them.
constexpr double end_stop_margin_rad = 0.05;
// A gear with stiffness 0 in the cell counts as rigid. It gets the stiffness that gives this natural frequency (200 Hz)
// with the inertia of its link, which is about the stiffest that the step allows.
constexpr double rigid_gear_rad_per_s = 2.0 * M_PI * 200.0;
// Limit for ω·h, the phase by which a mode ω advances in a step h. Symplectic Euler is unstable from ωh = 2 on; damping
// and rotors lower that limit a little.
constexpr double largest_phase_step = 1.5;

// Limit for step_share() at the start. The margin is enough because the masses at the arm's tip change by less than a
// third while the arm moves.
constexpr double largest_step_share = 0.75;

Mat3 inertia_matrix(const std::array<double, 6>& i) {
  Mat3 m;
  m << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  return m;
}

}  // namespace

struct ArmDynamics::Links {
  ModelPointer model;
  DataPointer data;
  int body = 0;     // index of the sensor's link L
  Pose X_LS, X_LT;  // L is the sensor's link
  RowMat3 R_BL = RowMat3::Identity();
  Vec3 p_BL = Vec3::Zero();
  Vec3 arm_B = Vec3::Zero();                   // from the origin of L to the origin of T, in B
  std::vector<double> lower_stop, upper_stop;  // one per axis
  MujocoJacobian jacobian;                     // 3 × nv; scratch memory
};

ArmDynamics::~ArmDynamics() = default;

ArmDynamics::ArmDynamics(const description::Cell& cell, double hand_mass_kg, double step_s, double hand_inertia_kg_m2)
    : links_(std::make_unique<Links>()),
      handle_(cell.tool),
      hand_mass_kg_(hand_mass_kg),
      hand_inertia_kg_m2_(hand_inertia_kg_m2),
      step_s_(step_s) {
  Links& l = *links_;
  l.model = load_links(cell, hand_mass_kg, hand_inertia_kg_m2);
  l.data.reset(mj_makeData(l.model.get()));
  const mjModel& m = *l.model;
  l.body = mj_name2id(&m, mjOBJ_BODY, cell.sensor.link.c_str());
  l.jacobian.resize(3, m.nv);
  X_WB_ = to_pose(cell.base_W);
  X_ST_ = to_pose(cell.tool.handle_S);
  l.X_LS = to_pose(cell.sensor.pose_link);
  l.X_LT = l.X_LS * X_ST_;
  gravity_W_ = Vec3(cell.gravity_W_m_per_s2.data());
  handle_inertia_S_ = inertia_matrix(cell.tool.inertia_kg_m2);

  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    const auto& drive = cell.drives[i];
    const std::string key = "drives[" + std::to_string(i) + "]";
    const int joint = mj_name2id(&m, mjOBJ_JOINT, drive.joint.c_str());
    if (joint < 0 || (m.jnt_type[joint] != mjJNT_HINGE && m.jnt_type[joint] != mjJNT_SLIDE)) {
      throw SetupError({.file = cell.file.string(),
                        .key = key + ".joint",
                        .found = drive.joint,
                        .expected = "a revolute or prismatic joint of " + cell.urdf.string()});
    }
    if (!(drive.rotor_inertia_kg_m2 > 0.0)) {
      throw SetupError({.file = cell.file.string(),
                        .key = key + ".rotor_inertia_kg_m2",
                        .found = description::number_text(drive.rotor_inertia_kg_m2),
                        .expected = "above 0 for the simulated arm"});
    }
    Axis axis;
    axis.dof = m.jnt_dofadr[joint];
    axis.rotor_inertia_kg_m2 = drive.rotor_inertia_kg_m2;
    axis.coulomb_Nm = drive.simulation.coulomb_friction_Nm;
    axis.brake_Nm = drive.simulation.brake_torque_Nm;
    axis.viscous_Nms_per_rad = drive.simulation.viscous_friction_Nms_per_rad;
    axis.stiffness_Nm_per_rad = drive.gear_stiffness_Nm_per_rad * drive.simulation.gear_stiffness_ratio;
    axis.damping_Nms_per_rad = drive.simulation.gear_damping_Nms_per_rad;
    axis.half_backlash_rad = 0.5 * drive.simulation.backlash_rad;
    axis.hysteresis_rad = drive.simulation.gear_hysteresis_rad;
    axis.ripple_Nm = drive.simulation.torque_ripple_Nm;
    axis.ripple_per_rad = drive.simulation.torque_ripple_per_revolution * drive.gear_ratio;
    axes_.push_back(axis);
    const bool limited = m.jnt_limited[joint] != 0;
    l.lower_stop.push_back(limited ? m.jnt_range[2 * joint] - end_stop_margin_rad : -mjMAXVAL);
    l.upper_stop.push_back(limited ? m.jnt_range[2 * joint + 1] + end_stop_margin_rad : mjMAXVAL);
  }
  if (m.nv != static_cast<int>(axes_.size())) {
    throw SetupError(
        {.file = cell.file.string(),
         .key = "drives",
         .found = std::to_string(axes_.size()) + " drives",
         .expected = "one for each of the " + std::to_string(m.nv) + " moving joints of " + cell.urdf.string()});
  }
  reset(cell.start_rad);
}

void ArmDynamics::reset(std::span<const double> joint_rad) {
  Links& l = *links_;
  mj_resetData(l.model.get(), l.data.get());
  for (std::size_t i = 0; i < axes_.size(); ++i) l.data->qpos[axes_[i].dof] = i < joint_rad.size() ? joint_rad[i] : 0.0;
  update_kinematics();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    if (!(axis.stiffness_Nm_per_rad > 0.0)) {
      // The diagonal element of M comes first in its row.
      const double inertia = l.data->qM[l.model->dof_Madr[axis.dof]];
      axis.stiffness_Nm_per_rad = inertia * rigid_gear_rad_per_s * rigid_gear_rad_per_s;
      axis.damping_Nms_per_rad = 0.1 * inertia * rigid_gear_rad_per_s;
    }
    const double torque = static_torque_Nm(i);
    const double flank = torque == 0.0 ? 0.0 : std::copysign(axis.half_backlash_rad, torque);
    axis.angle_rad = l.data->qpos[axis.dof] + flank + torque / axis.stiffness_Nm_per_rad;
    axis.speed_rad_per_s = 0.0;
    axis.torque_Nm = torque;
    axis.gear_friction_Nm = 0.0;
    axis.windup_rad = axis.angle_rad - l.data->qpos[axis.dof];
    axis.braked = true;
    axis.jammed = false;
  }
  const double highest = 2.0 * M_PI * locked_modes_Hz().back();
  if (!(highest * step_s_ < largest_phase_step)) {
    throw SetupError(
        {.key = "gear_stiffness_Nm_per_rad",
         .message = "the arm's highest mode is too fast for the simulation's step",
         .found = description::number_text(highest / (2.0 * M_PI)) + " Hz",
         .expected = "at most " + description::number_text(largest_phase_step / (2.0 * M_PI * step_s_)) + " Hz",
         .advice = "raise servo_rate_Hz, or lower the stiffness"});
  }
  if (const double share = step_share(); !(share < largest_step_share)) {
    throw SetupError({.key = "gear_damping_Nms_per_rad",
                      .message = "gears that are as stiff and as damped as these make the simulated arm explode",
                      .found = description::number_text(std::round(1e3 * share) / 1e3) + " of what its step of " +
                               description::number_text(1e3 * step_s_) + " ms bears",
                      .expected = "at most " + description::number_text(largest_step_share),
                      .advice = "raise servo_rate_Hz, lower simulation.gear_damping_Nms_per_rad or the stiffness, or "
                                "look for a rotor or link that is too light for its gear"});
  }
  std::vector<double> torque(axes_.size());
  for (std::size_t i = 0; i < axes_.size(); ++i) torque[i] = axes_[i].torque_Nm;
  apply(torque, Vec3::Zero());
}

// Advances the state by symplectic Euler: v(t+h) = v(t) + h a(t), then q(t+h) = q(t) + h v(t+h). The rotor follows (b),
// with the friction at time t+h: the rotor stops within the step, and stays stopped, if the friction suffices.
void ArmDynamics::advance() noexcept {
  mjData& d = *links_->data;
  const double h = step_s_;
  for (Axis& axis : axes_) {
    d.qvel[axis.dof] += h * d.qacc[axis.dof];
    d.qpos[axis.dof] += h * d.qvel[axis.dof];

    const double J = axis.rotor_inertia_kg_m2;
    const double free_speed = (axis.speed_rad_per_s + h / J * (axis.torque_Nm - axis.gear_torque_Nm)) /
                              (1.0 + h / J * axis.viscous_Nms_per_rad);
    const double friction = h / J * (axis.coulomb_Nm + (axis.braked ? axis.brake_Nm : 0.0));
    if ((axis.braked && axis.brake_Nm <= 0.0) || axis.jammed || std::abs(free_speed) <= friction) {
      axis.speed_rad_per_s = 0.0;
    } else {
      axis.speed_rad_per_s = free_speed - std::copysign(friction, free_speed);
      axis.angle_rad += h * axis.speed_rad_per_s;
    }
    if (axis.hysteresis_rad > 0.0) rub(axis);
  }
  update_kinematics();
}

void ArmDynamics::apply(std::span<const double> motor_torque_Nm, const Vec3& hand_force_W, const Vec3& arm_force_W,
                        const Vec3& hand_torque_W) noexcept {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    axis.torque_Nm = motor_torque_Nm[i];
    if (axis.ripple_Nm > 0.0) axis.torque_Nm += axis.ripple_Nm * std::sin(axis.ripple_per_rad * axis.angle_rad);
  }
  hand_force_W_ = hand_force_W;
  arm_force_W_ = arm_force_W;
  hand_torque_W_ = hand_torque_W;
  update_accelerations();
}

// Advances the gear's friction z by (d) for one step of δ: z approaches s z_m (s is the sign of the step) by the factor
// exp(−|step|/w).
void ArmDynamics::rub(Axis& axis) noexcept {
  const double windup = axis.angle_rad - links_->data->qpos[axis.dof], step = windup - axis.windup_rad;
  axis.windup_rad = windup;
  const double end = std::copysign(0.5 * axis.stiffness_Nm_per_rad * axis.hysteresis_rad, step);
  axis.gear_friction_Nm = end + (axis.gear_friction_Nm - end) * std::exp(-std::abs(step) / axis.hysteresis_rad);
}

// Returns the gear torque by (c). Each flank of the gear can only push.
double ArmDynamics::gear_torque(const Axis& axis) const noexcept {
  const mjData& d = *links_->data;
  const double windup = axis.angle_rad - d.qpos[axis.dof];
  const double rate = axis.speed_rad_per_s - d.qvel[axis.dof];
  const double k = axis.stiffness_Nm_per_rad, c = axis.damping_Nms_per_rad, half = axis.half_backlash_rad;
  if (half <= 0.0) return k * windup + c * rate + axis.gear_friction_Nm;
  if (windup > half) return std::max(0.0, k * (windup - half) + c * rate);
  if (windup < -half) return std::min(0.0, k * (windup + half) + c * rate);
  return 0.0;
}

void ArmDynamics::update_kinematics() noexcept {
  Links& l = *links_;
  const mjModel* m = l.model.get();
  mjData* d = l.data.get();
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_crb(m, d);
  mj_factorM(m, d);
  mj_comVel(m, d);
  mj_rne(m, d, 0, d->qfrc_bias);

  l.R_BL = Eigen::Map<const RowMat3>(d->xmat + 9 * l.body);
  l.p_BL = Eigen::Map<const Vec3>(d->xpos + 3 * l.body);
  l.arm_B = l.R_BL * l.X_LT.translation();
  std::array<double, 6> twist{};  // the angular part comes first
  mj_objectVelocity(m, d, mjOBJ_XBODY, l.body, twist.data(), 0);
  const Vec3 omega_B(twist.data()), v_B(twist.data() + 3);
  const Mat3 R_WB = X_WB_.linear();
  tool_.X_WT.linear() = R_WB * l.R_BL * l.X_LT.linear();
  tool_.X_WT.translation() = X_WB_ * Vec3(l.p_BL + l.arm_B);
  tool_.velocity_W = R_WB * (v_B + omega_B.cross(l.arm_B));
  tool_.angular_velocity_W = R_WB * omega_B;
}

// Computes the accelerations by (a). The person carries the hand's weight, so MuJoCo's gravity on the hand is
// compensated.
void ArmDynamics::update_accelerations() noexcept {
  Links& l = *links_;
  const mjModel* m = l.model.get();
  mjData* d = l.data.get();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    axis.gear_torque_Nm = gear_torque(axis);
    double stop = 0.0;
    const double angle = d->qpos[axis.dof], k = axis.stiffness_Nm_per_rad, c = axis.damping_Nms_per_rad;
    if (angle > l.upper_stop[i]) stop = std::min(0.0, k * (l.upper_stop[i] - angle) - c * d->qvel[axis.dof]);
    if (angle < l.lower_stop[i]) stop = std::max(0.0, k * (l.lower_stop[i] - angle) - c * d->qvel[axis.dof]);
    d->qfrc_applied[axis.dof] = axis.gear_torque_Nm + stop - d->qfrc_bias[axis.dof];
  }
  const Vec3 force_B = X_WB_.linear().transpose() * (hand_force_W_ + arm_force_W_ - hand_mass_kg_ * gravity_W_);
  const Vec3 torque_B = X_WB_.linear().transpose() * hand_torque_W_;
  const Vec3 point_B = l.p_BL + l.arm_B;
  mj_applyFT(m, d, force_B.data(), torque_B.data(), point_B.data(), l.body, d->qfrc_applied);
  mj_solveM(m, d, d->qacc, d->qfrc_applied, 1);
  update_tool_acceleration();
}

// Computes the tool's acceleration and the sensor's load about the origin of S. Handle (mass m, centre of mass C) and
// hand (mass m_h at T) follow the arm. So their load on the sensor is the force that acts on them minus the force that
// accelerates them:
//   F = F_hand − m_h a_T + m (g − a_C)
//   τ = r_T × (F_hand − m_h a_T) + (τ_hand − I_h α) + r_C × m (g − a_C) − (I α + ω × I ω)
void ArmDynamics::update_tool_acceleration() noexcept {
  const Links& l = *links_;
  mj_rnePostConstraint(l.model.get(), l.data.get());
  std::array<double, 6> a{};  // acceleration of L's origin, minus gravity; the angular part comes first
  mj_objectAcceleration(l.model.get(), l.data.get(), mjOBJ_XBODY, l.body, a.data(), 0);
  const Mat3 R_WB = X_WB_.linear();
  const Vec3 alpha_W = R_WB * Vec3(a.data());
  const Vec3 free_W = R_WB * Vec3(a.data() + 3);  // a_L − g
  const Vec3 omega_W = tool_.angular_velocity_W;
  const auto at = [&](const Vec3& r_W) -> Vec3 {
    return free_W + alpha_W.cross(r_W) + omega_W.cross(omega_W.cross(r_W));
  };
  const Mat3 R_WL = R_WB * l.R_BL;
  const Mat3 R_WS = R_WL * l.X_LS.linear();
  const Vec3 p_LT_W = R_WL * l.X_LT.translation();
  const Vec3 p_LC_W = R_WL * (l.X_LS * Vec3(handle_.centre_of_mass_S_m.data()));

  tool_.acceleration_W = at(p_LT_W) + gravity_W_;
  tool_.angular_acceleration_W = alpha_W;
  handle_force_W_ = hand_force_W_ - hand_mass_kg_ * tool_.acceleration_W;
  handle_torque_W_ = hand_torque_W_ - hand_inertia_kg_m2_ * alpha_W;
  const Vec3 handle_S = R_WS.transpose() * (-handle_.mass_kg * at(p_LC_W));  // m (g − a_C)
  const Vec3 hand_S = R_WS.transpose() * handle_force_W_;
  const Vec3 omega_S = R_WS.transpose() * omega_W, alpha_S = R_WS.transpose() * alpha_W;
  const Mat3& I = handle_inertia_S_;
  sensor_S_.force = hand_S + handle_S;
  sensor_S_.torque = X_ST_.translation().cross(hand_S) + Vec3(handle_.centre_of_mass_S_m.data()).cross(handle_S) -
                     (I * alpha_S + omega_S.cross(Vec3(I * omega_S))) + R_WS.transpose() * handle_torque_W_;
}

double ArmDynamics::joint_angle_rad(std::size_t axis) const noexcept { return links_->data->qpos[axes_[axis].dof]; }

double ArmDynamics::joint_speed_rad_per_s(std::size_t axis) const noexcept {
  return links_->data->qvel[axes_[axis].dof];
}

// Returns −∂/∂φ of the work of gravity: Σ (axis × lever) · (−m g) over the bodies behind the joint; for a prismatic
// joint, Σ axis · (−m g).
double ArmDynamics::static_torque_Nm(std::size_t axis) const noexcept {
  const mjModel* m = links_->model.get();
  const mjData* d = links_->data.get();
  const int dof = axes_[axis].dof, joint = m->dof_jntid[dof];
  const Vec3 axis_B(d->xaxis + 3 * joint), anchor_B(d->xanchor + 3 * joint), gravity_B(m->opt.gravity);
  const bool slides = m->jnt_type[joint] == mjJNT_SLIDE;
  const auto moved = [&](const Vec3& lever) { return slides ? axis_B : Vec3(axis_B.cross(lever)); };
  double torque = 0.0;
  for (int body = 1; body < m->nbody; ++body) {
    int ancestor = body;
    while (ancestor != 0 && ancestor != m->jnt_bodyid[joint]) ancestor = m->body_parentid[ancestor];
    if (ancestor == 0) continue;
    const Vec3 lever = Vec3(d->xipos + 3 * body) - anchor_B;
    torque -= moved(lever).dot(m->body_mass[body] * gravity_B);
  }
  const Vec3 lever_T = links_->p_BL + links_->arm_B - anchor_B;
  return torque + moved(lever_T).dot(hand_mass_kg_ * gravity_B);
}

Energy ArmDynamics::energy() const {
  const mjModel* m = links_->model.get();
  mjData* d = links_->data.get();
  Energy energy;
  std::vector<double> momentum(static_cast<std::size_t>(m->nv));
  mj_mulM(m, d, momentum.data(), d->qvel);
  for (int i = 0; i < m->nv; ++i) energy.kinetic_J += 0.5 * momentum[static_cast<std::size_t>(i)] * d->qvel[i];
  const Vec3 gravity_B(m->opt.gravity);
  for (int body = 1; body < m->nbody; ++body)
    energy.potential_J -= m->body_mass[body] * gravity_B.dot(Vec3(d->xipos + 3 * body));
  energy.potential_J += hand_mass_kg_ * gravity_B.dot(links_->p_BL + links_->arm_B);
  for (const Axis& axis : axes_) {
    energy.kinetic_J += 0.5 * axis.rotor_inertia_kg_m2 * axis.speed_rad_per_s * axis.speed_rad_per_s;
    const double windup = axis.angle_rad - d->qpos[axis.dof];
    const double stretch = std::max(0.0, std::abs(windup) - axis.half_backlash_rad);
    energy.elastic_J += 0.5 * axis.stiffness_Nm_per_rad * stretch * stretch;
  }
  return energy;
}

Mat3 ArmDynamics::effective_mass_kg() const {
  Links& l = *links_;
  const mjModel* m = l.model.get();
  models::SmallMatrix M(m->nv, m->nv);
  mj_fullM(m, M.data(), l.data->qM);
  const Vec3 point_B = l.p_BL + l.arm_B;
  mj_jac(m, l.data.get(), l.jacobian.data(), nullptr, point_B.data(), l.body);
  M -= (hand_mass_kg_ * l.jacobian.transpose()).lazyProduct(l.jacobian);
  for (const Axis& axis : axes_) M(axis.dof, axis.dof) += axis.rotor_inertia_kg_m2;
  const Mat3 inverse_B =
      l.jacobian.lazyProduct(models::solve_positive_definite(M, models::SmallColumns3(l.jacobian.transpose())));
  const Mat3 R_WB = X_WB_.linear();
  return R_WB * inverse_B.inverse() * R_WB.transpose();
}

double ArmDynamics::step_share() const {
  const mjModel* m = links_->model.get();
  const Eigen::Index n = m->nv;
  models::SmallMatrix links(n, n);
  mj_fullM(m, links.data(), links_->data->qM);
  // Links come first, then rotors. Each gear connects one link and one rotor.
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(2 * n, 2 * n), F = M;
  M.topLeftCorner(n, n) = links;
  for (const Axis& axis : axes_) {
    const Eigen::Index link = axis.dof, rotor = n + axis.dof;
    M(rotor, rotor) = axis.rotor_inertia_kg_m2;
    // When the motion of a gear with hysteresis reverses, the gear is twice as stiff: dz/dδ in (d) is then k/2 (1 + 1)
    // = k, in addition to the spring's k.
    const double stiffest = (axis.hysteresis_rad > 0.0 ? 2.0 : 1.0) * axis.stiffness_Nm_per_rad;
    const double gear = step_s_ * step_s_ * stiffest + 2.0 * step_s_ * axis.damping_Nms_per_rad;
    F(link, link) += gear;
    F(rotor, rotor) += gear;
    F(link, rotor) -= gear;
    F(rotor, link) -= gear;
  }
  return models::generalized_eigenvalues(F, M)[2 * n - 1] / 4.0;
}

std::vector<double> ArmDynamics::locked_modes_Hz() const {
  const mjModel* m = links_->model.get();
  models::SmallMatrix M(m->nv, m->nv);
  mj_fullM(m, M.data(), links_->data->qM);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(m->nv, m->nv);
  for (const Axis& axis : axes_) K(axis.dof, axis.dof) = axis.stiffness_Nm_per_rad;
  const Eigen::VectorXd squares = models::generalized_eigenvalues(K, M);
  std::vector<double> modes;
  for (int i = 0; i < m->nv; ++i) modes.push_back(std::sqrt(squares[i]) / (2.0 * M_PI));
  return modes;
}

}  // namespace proxarm::sim
