// A rigid tool and its scene as the cycle sees them: wrench in, next pose of the tool out.
//
// RenderedWorld's functions handle the tool's position, as for a point. Orientation has its own: set_torque_W() before
// a step, orientation() after it, turn_to() before start() and resume().
//
// Limits act on p̂, before 𝒢: its position is projected onto the step's sets (step_limits.hpp), its rotation onto those
// of turning speed, angle from the orientation at the first start, tilt and twist. A contact may still turn the tool
// further, like a lever that is pushed at its end. If q leaves the rotation sets by more than 1 µrad, the step is
// repeated with these sets as walls. With n the axis about which q turns back into the sets,
//   ½‖q ⊟ p̂‖²_K + ½ s (nᵀ(q ⊟ p̂)_θ − c)²
// c is at the set's border, and s is the stiffness of a held orientation, 1e4 (5 cm)² K_xx: the wall yields by 1e-7 rad
// to 10 Nm. This is 𝒢 with K + s n nᵀ, for p̂ ⊞ (K + s n nᵀ)⁻¹ s c n. There may be up to three walls, since each
// repetition may leave other sets. If q(k−1) is already outside, as after a hold, a wall turns it back by 1 µrad per
// step, which is 100 Nm against the contact that holds the tool there; p̂ does the faster return.
//
// Among moving objects a step can't be repeated. There, and for the position, q keeps the limits only as far as
// contacts bring it nearer to q(k−1). The guards of the setpoints have the last word (docs/tool.md).
#pragma once

#include <memory>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/pose_proxy.hpp"
#include "controller/proxies/turn_sets.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "controller/rendering/scene_changes.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "models/surfaces/free_space.hpp"

namespace proxarm::controller {

struct PoseWorldConfig {
  PoseConfig proxy;
  TurnSets turn{};  // counted from the orientation at the first start
};

class PoseWorld final : public RenderedWorld {
 public:
  // Precondition: the scene outlives this object, and `g` is its tool's 𝒢 (scenes/rigid/compile_rigid.hpp).
  PoseWorld(std::unique_ptr<models::PoseAlgorithm> g, scenes::CompiledScene& scene, const PoseWorldConfig& config);

  // The hand's torque about the rendered point in the next step.
  void set_torque_W(const models::Vec3& torque_W) noexcept { torque_W_ = torque_W; }
  // For the next start() or resume(): the tool's orientation and angular velocity.
  void turn_to(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept;
  // Share of the turning speed limit, 0 to 1.
  void limit_turning(double share) noexcept { speed_share_ = share; }
  // Like add_damping(), for turning.
  void add_turning_damping(double damping_Nms_per_rad) noexcept;
  [[nodiscard]] const PoseConfig& config() const noexcept { return proxy_.config(); }  // includes added damping
  [[nodiscard]] double own_turning_damping_Nms_per_rad() const noexcept { return turning_damping_Nms_per_rad_; }
  [[nodiscard]] double kinetic_J() const noexcept { return proxy_.kinetic_J(); }
  [[nodiscard]] const Eigen::Quaterniond& orientation() const noexcept { return proxy_.q().orientation; }
  [[nodiscard]] models::Vec3 angular_velocity_W() const noexcept {
    return proxy_.move().tail<3>() / proxy_.config().period_s;
  }
  [[nodiscard]] bool turning_limited() const noexcept { return turning_limited_; }  // in the last step
  // Sets of turning for the next step.
  [[nodiscard]] TurnSets sets() const noexcept;

  void start(const models::Vec3& q_W) noexcept override;
  WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept override;
  models::Vec3 look_ahead(const models::Vec3& /*h_W*/, const StepLimits& /*limits*/,
                          double /*horizon_s*/) noexcept override {
    return proxy_.q().position;
  }
  models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept override;
  void set(const Change& change) noexcept override;
  // See RenderedTool. A value that would make the proxy's mass indefinite changes nothing.
  void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept;
  void set_period(double period_s) noexcept override {
    changes_.set_period(period_s);
    proxy_.set_period(period_s);
  }
  void add_damping(double damping_Ns_per_m) noexcept override;
  void archive(fieldbus::StateArchive& state) noexcept override;

 private:
  [[nodiscard]] models::ToolPose outside(const models::ToolPose& wanted) noexcept;
  void limit_place(const StepLimits& limits, models::ToolPose& p_hat) noexcept;
  void hold_rotation(const models::ToolPose& p_hat) noexcept;
  void return_reference() noexcept;
  void report(const models::ToolPose& p_hat, const models::ToolPose& limited) noexcept;
  void report_contacts() noexcept;
  void set_springs(PoseConfig changed) noexcept;

  PoseWorldConfig config_;
  std::unique_ptr<models::PoseAlgorithm> g_;
  SceneChanges changes_;
  models::FreeSpace<3> no_world_;
  LimitedAlgorithm<3> limits_;
  PoseProxy proxy_;
  Touches touches_;
  WorldStep last_;                               // its touches are stored in touches_
  models::Twist walls_ = models::Twist::Zero();  // wrench of the rotation walls in the last step
  models::Vec3 torque_W_ = models::Vec3::Zero(), omega_W_ = models::Vec3::Zero();
  Eigen::Quaterniond R_WT_ = Eigen::Quaterniond::Identity();  // for start() and resume()
  models::ToolPose home_;                                     // of the first start
  double damping_Ns_per_m_, added_Ns_per_m_ = 0.0, speed_share_ = 1.0;
  double turning_damping_Nms_per_rad_, added_Nms_per_rad_ = 0.0;
  bool started_ = false, turning_limited_ = false;
  bool no_room_ = false;  // the tool's start pose is inside an object
};

}  // namespace proxarm::controller
