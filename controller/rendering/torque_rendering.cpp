#include "controller/rendering/torque_rendering.hpp"

#include <algorithm>
#include <cmath>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/rendering/scene_space.hpp"
#include "models/geometry/eigenvalues.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec;
using models::Vec3;

namespace {

JointVector largest_torques(const std::vector<description::DriveDescription>& drives) {
  JointVector most(static_cast<Eigen::Index>(drives.size()));
  for (std::size_t i = 0; i < drives.size(); ++i) most[static_cast<Eigen::Index>(i)] = drives[i].max_torque_Nm;
  return most;
}

template <int N>
class TorquesOfDimension final : public TorqueRendering {
 public:
  TorquesOfDimension(scenes::CompiledScene& scene, const models::Arm& arm,
                     const std::vector<description::DriveDescription>& drives, const description::CellLimits& limits,
                     const ImpedanceConfig& config)
      : scene_(&scene),
        arm_(&arm),
        space_(scene),
        limited_(scene.algorithm<N>()),
        proxy_(config, limited_),
        limiter_(drives, limits, config.period_s),
        most_Nm_(largest_torques(drives)) {
    last_.torque_Nm = JointVector::Zero(most_Nm_.size());
  }

  void anchor(const JointVector& link_rad) noexcept override {
    anchor_W_ = p_k1_W_ = arm_->tool_pose(link_rad).translation();
  }

  const TorqueStep& hold(const JointVector& link_rad) noexcept override {
    arm_->kinematics(link_rad, tool_);
    const Vec3 p_W = tool_.X_WT.translation();
    last_.world = {};
    last_.world.q_W = anchor_W_;
    last_.limits = {};
    turn_into_torques(link_rad, spring_to(anchor_W_, p_W));
    p_k1_W_ = p_W;
    return last_;
  }

  void start(const JointVector& link_rad) noexcept override {
    anchor(link_rad);
    space_.start(anchor_W_);
    proxy_.start(space_.start());
  }

  const TorqueStep& step(const JointVector& link_rad) noexcept override {
    arm_->kinematics(link_rad, tool_);
    const Vec3 p_W = tool_.X_WT.translation();
    const Vec<N> p = space_.from_W(p_W);
    limiter_.make_walls(p_W, link_rad, tool_.J_W, walls_);
    limited_.set_limits(walls_, space_.basis(), p);
    WorldStep& world = last_.world;
    world = {};
    world.fault = proxy_.step(p);
    last_.limits = limited_.active();
    if (world.fault != ProxyFault::none) return last_;
    world.q_W = space_.to_W(proxy_.q());
    world.p_hat_W = space_.to_W(proxy_.p_hat());
    Vec3 f_W = space_.basis() * proxy_.f();
    world.limit_force_W = space_.basis() * (proxy_.kappa_N_per_m() * limited_.limit_shift());
    world.f_W = f_W - world.limit_force_W;
    world.limits = last_.limits;
    add_contacts<N>(world, scene_->algorithm<N>().contacts(), space_.basis());
    if constexpr (N < 3) {
      const Vec3 held = spring_to(space_.start_W(), p_W);
      f_W += held - space_.basis() * (space_.basis().transpose() * held);
    }
    turn_into_torques(link_rad, f_W);
    p_k1_W_ = p_W;
    return last_;
  }

  void archive(fieldbus::StateArchive& state) noexcept override { state(space_, proxy_, anchor_W_, p_k1_W_); }

 private:
  [[nodiscard]] Vec3 spring_to(const Vec3& rest_W, const Vec3& p_W) const noexcept {
    const ImpedanceConfig& c = proxy_.config();
    return c.stiffness_N_per_m * (rest_W - p_W) - c.damping_Ns_per_m / c.period_s * (p_W - p_k1_W_);
  }

  void turn_into_torques(const JointVector& link_rad, const Vec3& f_W) noexcept {
    const JointVector gravity_Nm = arm_->gravity_torque(link_rad);
    const JointVector rendered_Nm = tool_.J_W.topRows<3>().transpose() * f_W;
    double share = 1.0;
    for (Eigen::Index i = 0; i < rendered_Nm.size(); ++i) {
      const double room_Nm = most_Nm_[i] - std::copysign(1.0, rendered_Nm[i]) * gravity_Nm[i];
      if (std::abs(rendered_Nm[i]) * share <= room_Nm) continue;
      share = std::max(0.0, room_Nm / std::abs(rendered_Nm[i]));
      last_.limits.set(Limit::joint_torque, static_cast<std::uint8_t>(1u << i));
    }
    last_.torque_Nm = gravity_Nm + share * rendered_Nm;
  }

  scenes::CompiledScene* scene_;
  const models::Arm* arm_;
  SceneSpace<N> space_;
  LimitedAlgorithm<N> limited_;
  ImpedanceProxy<N> proxy_;
  StepLimiter limiter_;
  JointVector most_Nm_;
  StepLimits walls_;
  models::ToolKinematics tool_;
  Vec3 anchor_W_ = Vec3::Zero(), p_k1_W_ = Vec3::Zero();
  TorqueStep last_;
};

}  // namespace

std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config) {
  switch (scene.dimensions()) {
    case 1:
      return std::make_unique<TorquesOfDimension<1>>(scene, arm, drives, limits, config);
    case 2:
      return std::make_unique<TorquesOfDimension<2>>(scene, arm, drives, limits, config);
    default:
      return std::make_unique<TorquesOfDimension<3>>(scene, arm, drives, limits, config);
  }
}

// State (x, v, u, x₁): x⁺ = x + T v + T²u/(2m), v⁺ = v + T u/m, u⁺ = −K x − B(x − x₁)/T, x₁⁺ = x.
double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg) {
  const double K = config.stiffness_N_per_m, B = config.damping_Ns_per_m, T = config.period_s, m = mass_kg;
  Eigen::MatrixXd A(4, 4);
  A << 1.0, T, T * T / (2.0 * m), 0.0,  //
      0.0, 1.0, T / m, 0.0,             //
      -K - B / T, 0.0, 0.0, B / T,      //
      1.0, 0.0, 0.0, 0.0;
  return models::spectral_radius(A);
}

}  // namespace proxarm::controller
