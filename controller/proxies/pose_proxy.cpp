#include "controller/proxies/pose_proxy.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "models/base/option_check.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::controller {
namespace {

using models::Mat3;
using models::Mat6;
using models::ToolPose;
using models::Twist;
using models::Vec3;

// Largest angle by which p̂ is turned from q in a step; larger angles are reduced to this. The torque towards p̂ would
// pull back if the angle exceeded half a turn, and would be zero at a full turn. 10 Nm on 3e-5 kg m² at 250 Hz would
// turn p̂ by nearly a full turn.
constexpr double kMostTurn_rad = 1.0;

Mat3 cross_matrix(const Vec3& v) noexcept {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

bool in_range(const PoseConfig& c) noexcept {
  return is_positive(c.mass_kg) && is_positive(c.inertia_kg_m2) && is_not_negative(c.damping_Ns_per_m) &&
         is_not_negative(c.spring_N_per_m) && is_not_negative(c.turning_damping_Nms_per_rad) &&
         is_not_negative(c.turning_spring_Nm_per_rad) && is_positive(c.period_s);
}

// Returns M₆ along the axes of centre_m and inertia_kg_m2.
Mat6 mass_matrix(const PoseConfig& config, const Vec3& centre_m, const Mat3& inertia_kg_m2) noexcept {
  Mat6 M = Mat6::Zero();
  M.topLeftCorner<3, 3>() = config.mass_kg * Mat3::Identity();
  M.bottomRightCorner<3, 3>() = config.inertia_kg_m2 * Mat3::Identity() - inertia_kg_m2;
  M.topRightCorner<3, 3>() = config.behind_mass_kg * cross_matrix(centre_m);
  M.bottomLeftCorner<3, 3>() = -config.behind_mass_kg * cross_matrix(centre_m);
  return M;
}

// This function factorises A, so call it only at set-up and after a change.
bool is_positive_definite(const Mat6& A) noexcept {
  const Eigen::LLT<Mat6> factor(A);
  return factor.info() == Eigen::Success;
}

}  // namespace

Mat6 PoseConfig::mass_T() const noexcept { return mass_matrix(*this, behind_centre_T_m, behind_inertia_T_kg_m2); }

void PoseConfig::validate() const {
  AdmittanceConfig{
      .mass_kg = mass_kg, .damping_Ns_per_m = damping_Ns_per_m, .spring_N_per_m = spring_N_per_m, .period_s = period_s}
      .validate();
  require_option(is_positive(inertia_kg_m2), "--inertia", inertia_kg_m2, "kg m², above 0");
  require_option(is_not_negative(turning_damping_Nms_per_rad), "--turning-damping", turning_damping_Nms_per_rad,
                 "Nms/rad, 0 or more");
  require_option(is_not_negative(turning_spring_Nm_per_rad), "--turning-spring", turning_spring_Nm_per_rad,
                 "Nm/rad, 0 or more");
  require_option(held || is_positive_definite(mass_T()), "--inertia", inertia_kg_m2,
                 "kg m², more than the tool behind the sensor has about any axis, with this --mass");
}

PoseProxy::PoseProxy(const PoseConfig& config, models::PoseAlgorithm& g) : config_(config), g_(&g) {
  config_.validate();
  make_K();
}

void PoseProxy::start(const ToolPose& q, double time_s) noexcept {
  q_k1_ = q_k2_ = reference_ = q;
  move_.setZero();
  wrench_W_.setZero();
  time_s_ = time_s;
  tell_time();
  make_K();
}

// Sets the time of 𝒢. Moving objects must start, to the bit, at the place where the last step left them.
void PoseProxy::tell_time() noexcept {
  if (g_->wants_time()) g_->set_time({time_s_, config_.period_s});
}

void PoseProxy::resume(const ToolPose& q, const Twist& velocity_W) noexcept {
  q_k1_ = q_k2_ = q;
  move_ = config_.period_s * velocity_W;
  if (config_.held) {
    move_.tail<3>().setZero();
    reference_.orientation = q.orientation;
  }
  make_K();
}

// Computes K, and M₆ in W for the present orientation.
void PoseProxy::make_K() noexcept {
  const double T = config_.period_s;
  const Mat3 R = q_k1_.orientation.toRotationMatrix();
  centre_W_ = R * config_.behind_centre_T_m;
  inertia_W_ = R * config_.behind_inertia_T_kg_m2 * R.transpose();
  if (config_.held) {
    mass_W_.setZero();
    mass_W_.topLeftCorner<3, 3>() = config_.mass_kg * Mat3::Identity();
  } else {
    mass_W_ = mass_matrix(config_, centre_W_, inertia_W_);
  }
  K_ = mass_W_ / (T * T);
  K_.diagonal().head<3>().array() += config_.damping_Ns_per_m / T + config_.spring_N_per_m;
  if (config_.held) {
    K_.diagonal().tail<3>().setConstant(holds_Nm_per_rad());
  } else {
    K_.diagonal().tail<3>().array() += config_.turning_damping_Nms_per_rad / T + config_.turning_spring_Nm_per_rad;
  }
}

ToolPose PoseProxy::predict(const models::Wrench& h_W) noexcept {
  make_K();
  const double T = config_.period_s;
  const Vec3 omega = move_.tail<3>() / T;
  Twist pull;
  pull << h_W.force, h_W.torque;
  if (!config_.held) {
    pull.head<3>() += config_.behind_mass_kg * omega.cross(omega.cross(centre_W_));
    pull.tail<3>() += omega.cross(Vec3(inertia_W_ * omega));
  }
  pull += mass_W_ * move_ / (T * T);
  if (config_.spring_N_per_m > 0.0 || config_.turning_spring_Nm_per_rad > 0.0) {
    const Twist e = models::difference(q_k1_, reference_);
    pull.head<3>() -= config_.spring_N_per_m * e.head<3>();
    pull.tail<3>() -= config_.turning_spring_Nm_per_rad * e.tail<3>();
  }
  Twist xi = models::solve_square<6>(K_, pull);
  if (config_.held) return {q_k1_.position + xi.head<3>(), reference_.orientation};
  const double turn = xi.tail<3>().norm();
  if (turn > kMostTurn_rad) xi.tail<3>() *= kMostTurn_rad / turn;
  return models::moved(q_k1_, xi);
}

ProxyFault PoseProxy::step(const ToolPose& p_hat) noexcept {
  if (!p_hat.position.allFinite() || !p_hat.orientation.coeffs().allFinite()) return ProxyFault::result_not_finite;
  const double time_s = time_s_ + config_.period_s;
  if (g_->wants_time()) g_->set_time({time_s, config_.period_s});
  const ToolPose from = q_k1_;
  const ProxyFault fault = go(K_, p_hat, from);
  if (fault != ProxyFault::none) return fault;
  q_k2_ = from;
  time_s_ = time_s;
  return ProxyFault::none;
}

ProxyFault PoseProxy::again(const Mat6& K, const ToolPose& p_hat) noexcept { return go(K, p_hat, q_k2_); }

ProxyFault PoseProxy::go(const Mat6& K, const ToolPose& p_hat, const ToolPose& from) noexcept {
  const ToolPose q = g_->step(K, p_hat, from);
  const Twist wrench = K * models::difference(q, p_hat), move = models::difference(q, from);
  if (!wrench.allFinite() || !move.allFinite()) return ProxyFault::result_not_finite;
  wrench_W_ = wrench;
  move_ = move;
  q_k1_ = q;
  return ProxyFault::none;
}

bool PoseProxy::set(const PoseConfig& changed) noexcept {
  if (!in_range(changed) || (!changed.held && !is_positive_definite(changed.mass_T()))) return false;
  config_ = changed;
  return true;
}

void PoseProxy::archive(fieldbus::StateArchive& state) noexcept {
  state(q_k1_.position, q_k1_.orientation, reference_.position, reference_.orientation, move_, wrench_W_, time_s_,
        config_.mass_kg, config_.inertia_kg_m2, config_.damping_Ns_per_m, config_.spring_N_per_m,
        config_.turning_damping_Nms_per_rad, config_.turning_spring_Nm_per_rad, config_.behind_mass_kg,
        config_.behind_centre_T_m, config_.behind_inertia_T_kg_m2);
  if (state.reading()) tell_time();
  make_K();
}

}  // namespace proxarm::controller
