#include "controller/rendering/torque_rendering.hpp"

#include <algorithm>
#include <cmath>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/rendering/joint_coupling.hpp"
#include "controller/rendering/scene_space.hpp"
#include "models/geometry/eigenvalues.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec;
using models::Vec3;

namespace {

// Largest speed at which a coupling may release its energy. A hand that leaves a wall faster only feels a softer wall.
constexpr double release_m_per_s = 0.07;

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
        limiter_(limits, config.period_s),
        coupling_(arm, drives, limits, config.period_s),
        most_Nm_(largest_torques(drives)) {
    none_ = missing_Nm_ = carried_Nm_ = limits_Nm_ = last_.torque_Nm = last_.held_Nm =
        JointVector::Zero(most_Nm_.size());
  }

  void anchor(const JointVector& link_rad) noexcept override {
    p_k1_W_ = arm_->tool_pose(link_rad).translation();
    coupling_.start(link_rad);
    missing_Nm_.setZero();
  }

  const TorqueStep& hold(const JointVector& link_rad) noexcept override {
    arm_->kinematics(link_rad, tool_);
    p_k1_W_ = tool_.X_WT.translation();
    last_.world = {};
    last_.world.q_W = p_k1_W_;
    last_.limits = {};
    keep_device(link_rad, Vec3::Zero(), Vec3::Zero(), 0.0);
    turn_into_torques(Vec3::Zero());
    return last_;
  }

  void start(const JointVector& link_rad, const JointVector& missing_Nm) noexcept override {
    anchor(link_rad);
    missing_Nm_ = missing_Nm;
    space_.start(p_k1_W_);
    proxy_.start(space_.start());
    limited_.start();
  }

  const TorqueStep& step(const JointVector& link_rad, double max_tool_speed_m_per_s) noexcept override {
    arm_->kinematics(link_rad, tool_);
    const Vec3 p_W = tool_.X_WT.translation();
    const Vec<N> p = space_.from_W(p_W);
    limiter_.make_walls(p_W, walls_);
    limited_.set_limits(walls_, space_.basis(), p);
    const Vec<N> q_k1 = proxy_.q();
    WorldStep& world = last_.world;
    world = {};
    world.fault = proxy_.step(p);
    last_.limits = limited_.active();
    if (world.fault != ProxyFault::none) return last_;
    Vec3 f_W = space_.basis() * proxy_.f();
    const double e = keep_device(link_rad, f_W, space_.basis() * (proxy_.q() - q_k1), max_tool_speed_m_per_s);
    f_W *= e;
    world.q_W = space_.to_W(proxy_.q());
    world.p_hat_W = space_.to_W(proxy_.p_hat());
    world.limit_force_W = space_.basis() * (e * proxy_.kappa_N_per_m() * limited_.limit_shift());
    world.f_W = f_W - world.limit_force_W;
    add_contacts<N>(world, touches_, scene_->algorithm<N>().contacts(), space_.basis());
    if constexpr (N < 3) {
      const Vec3 held = spring_to(space_.start_W(), p_W);
      f_W += held - space_.basis() * (space_.basis().transpose() * held);
    }
    turn_into_torques(f_W);
    world.limits = last_.limits;
    p_k1_W_ = p_W;
    return last_;
  }

  void archive(fieldbus::StateArchive& state) noexcept override {
    state(space_, proxy_, limited_, coupling_, missing_Nm_, p_k1_W_);
  }

 private:
  [[nodiscard]] Vec3 spring_to(const Vec3& rest_W, const Vec3& p_W) const noexcept {
    const ImpedanceConfig& c = proxy_.config();
    return c.stiffness_N_per_m * (rest_W - p_W) - c.damping_Ns_per_m / c.period_s * (p_W - p_k1_W_);
  }

  // Computes the torques of the device's limits while the world renders f and its proxy moves by q_step_W. Returns e.
  double keep_device(const JointVector& link_rad, const Vec3& f_W, const Vec3& q_step_W,
                     double max_tool_speed_m_per_s) noexcept {
    carried_Nm_ = arm_->gravity_torque(link_rad) + missing_Nm_;
    const double wanted_N = f_W.norm();
    JointCoupling::Bounds bounds{.tool_speed_m_per_s = max_tool_speed_m_per_s};
    if (wanted_N > 0.0) {
      std::uint8_t cut = 0;
      const JointVector rendered_Nm = tool_.J_W.topRows<3>().transpose() * f_W;
      bounds.n_W = f_W / wanted_N;
      bounds.step_m = std::max(0.0, bounds.n_W.dot(q_step_W) + release_m_per_s * proxy_.config().period_s);
      bounds.force_N = torque_share(rendered_Nm, carried_Nm_, none_, most_Nm_, cut) * wanted_N;
    }
    limits_Nm_ = coupling_.step(link_rad, tool_.J_W, bounds);
    return wanted_N > 0.0 ? std::max(0.0, 1.0 - coupling_.released_N() / wanted_N) : 1.0;
  }

  void turn_into_torques(const Vec3& f_W) noexcept {
    const JointVector rendered_Nm = tool_.J_W.topRows<3>().transpose() * f_W;
    std::uint8_t cut = 0;
    const double held = torque_share(limits_Nm_, carried_Nm_, none_, most_Nm_, cut);
    coupling_.yield(held);
    last_.held_Nm = held * limits_Nm_;
    const double share = torque_share(rendered_Nm, carried_Nm_, last_.held_Nm, most_Nm_, cut);
    if (cut != 0) last_.limits.set(Limit::joint_torque, cut);
    last_.limits.add(coupling_.active());
    last_.torque_Nm = carried_Nm_ + last_.held_Nm + share * rendered_Nm;
  }

  scenes::CompiledScene* scene_;
  const models::Arm* arm_;
  SceneSpace<N> space_;
  LimitedAlgorithm<N> limited_;
  ImpedanceProxy<N> proxy_;
  StepLimiter limiter_;
  JointCoupling coupling_;
  JointVector most_Nm_, missing_Nm_, none_;
  // Torques of this step: carried_Nm_ = τ_g + τ_0, limits_Nm_ = τ_U.
  JointVector carried_Nm_, limits_Nm_;
  StepLimits walls_;
  models::ToolKinematics tool_;
  Vec3 p_k1_W_ = Vec3::Zero();
  Touches touches_;
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

double torque_share(const JointVector& wanted, const JointVector& base, const JointVector& beside,
                    const JointVector& most, std::uint8_t& cut) noexcept {
  double share = 1.0;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const double room = most[i] - std::abs(beside[i]) - std::copysign(1.0, wanted[i]) * base[i];
    if (std::abs(wanted[i]) * share <= room) continue;
    share = std::max(0.0, room / std::abs(wanted[i]));
    cut = static_cast<std::uint8_t>(cut | 1u << i);
  }
  return share;
}

// The loop's state is (x, v, u, x₁): x⁺ = x + T v + T²u/(2m), v⁺ = v + T u/m, u⁺ = −K x − B(x − x₁)/T, x₁⁺ = x.
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
