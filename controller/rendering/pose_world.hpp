// Computes the next pose of a rigid tool in its scene from the hand's wrench.
//
// RenderedWorld's functions handle the tool's position, as for a point. Further functions handle its orientation:
// set_torque_W() before a step, orientation() after a step, turn_to() before start() and resume().
//
// Limits act on p̂, before 𝒢. The position of p̂ is projected onto the step's sets (step_limits.hpp). The rotation of
// p̂ is projected onto the sets of turning: turning speed, angle from the orientation at the first start, tilt and
// twist.
//
// A contact may turn the tool beyond the sets of turning, like a lever that is pushed at its end. If q leaves these
// sets by more than 1 µrad, the step is repeated with a wall, which adds the second term to the minimised function:
//   ½‖q ⊟ p̂‖²_K + ½ s (nᵀ(q ⊟ p̂)_θ − c)²
// n: the axis about which q turns back into the sets. c: the angle at the sets' border. s: the stiffness of a held
// orientation, 1e4 (5 cm)² K_xx, so the wall yields by 1e-7 rad to 10 Nm. The minimum is 𝒢 with K + s n nᵀ for
// p̂ ⊞ (K + s n nᵀ)⁻¹ s c n. There may be up to three walls, since a repeated step may leave the sets elsewhere. If
// q(k−1) is already beyond the sets, as after a hold, a wall turns q back by only 1 µrad per step: this is a torque of
// 100 Nm against the contact that holds the tool there. The projection of p̂ returns the tool faster.
//
// In a scene with moving objects a step can't be repeated. So the rotation in such scenes, and the position in all
// scenes, keep the limits only if contacts don't move q from p̂ away from q(k−1). The guards of the setpoints have the
// last word (docs/how_to/tool.md).
#pragma once

#include <memory>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/pose_proxy.hpp"
#include "controller/proxies/turn_sets.hpp"
#include "controller/rendering/pose_lookahead.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "controller/rendering/scene_changes.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "models/surfaces/free_space.hpp"

namespace proxarm::controller {

struct PoseWorldConfig {
  PoseConfig proxy;
  TurnSets turn{};  // angles count from the orientation at the first start
  bool looks_ahead = false;
};

class PoseWorld final : public RenderedWorld {
 public:
  // Precondition: the scene outlives this object, and `g` is the 𝒢 of the scene's tool
  // (scenes/rigid/compile_rigid.hpp).
  PoseWorld(std::unique_ptr<models::PoseAlgorithm> g, scenes::CompiledScene& scene, const PoseWorldConfig& config);

  // Sets the hand's torque about the rendered point in the next step.
  void set_torque_W(const models::Vec3& torque_W) noexcept { torque_W_ = torque_W; }
  // Sets the tool's orientation and angular velocity for the next start() or resume().
  void turn_to(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept;
  // Limits turning to a share of the turning speed limit, 0 to 1.
  void limit_turning(double share) noexcept { speed_share_ = share; }
  // Sets the damping of turning that is added to the user's from the next step on (passivity.hpp).
  void add_turning_damping(double damping_Nms_per_rad) noexcept;
  [[nodiscard]] const PoseConfig& config() const noexcept { return proxy_.config(); }  // includes added damping
  [[nodiscard]] double own_turning_damping_Nms_per_rad() const noexcept { return turning_damping_Nms_per_rad_; }
  [[nodiscard]] double kinetic_J() const noexcept { return proxy_.kinetic_J(); }
  [[nodiscard]] const Eigen::Quaterniond& orientation() const noexcept { return proxy_.q().orientation; }
  [[nodiscard]] models::Vec3 angular_velocity_W() const noexcept {
    return proxy_.move().tail<3>() / proxy_.config().period_s;
  }
  // Whether a limit of turning was active in the last step.
  [[nodiscard]] bool turning_limited() const noexcept { return turning_limited_; }
  // Returns the sets of turning for the next step.
  [[nodiscard]] TurnSets sets() const noexcept;

  void start(const models::Vec3& q_W) noexcept override;
  WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept override;
  // Precondition: h_W is 0.
  models::Vec3 look_ahead(const models::Vec3& /*h_W*/, const StepLimits& limits, double horizon_s) noexcept override {
    return ahead_ && horizon_s > 0.0 ? (*ahead_)(proxy_, limits, horizon_s) : proxy_.q().position;
  }
  models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept override;
  void set(const Change& change) noexcept override;
  // See RenderedTool. Values with which M₆ (pose_proxy.hpp) isn't positive definite change nothing.
  void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept;
  void set_period(double period_s) noexcept override {
    changes_.set_period(period_s);
    proxy_.set_period(period_s);
  }
  void add_damping(double damping_Ns_per_m) noexcept override;
  void archive(fieldbus::StateArchive& state) noexcept override;

 private:
  scenes::CompiledScene& with_setters(scenes::CompiledScene& scene);
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
  std::unique_ptr<PoseLookahead> ahead_;  // null: no lookahead
  Touches touches_;
  WorldStep last_;                               // last_.touches refers to touches_
  models::Twist walls_ = models::Twist::Zero();  // the walls' wrench in the last step
  models::Vec3 torque_W_ = models::Vec3::Zero(), omega_W_ = models::Vec3::Zero();
  Eigen::Quaterniond R_WT_ = Eigen::Quaterniond::Identity();  // orientation for start() and resume()
  models::ToolPose home_;                                     // the tool's pose at the first start
  double damping_Ns_per_m_, added_Ns_per_m_ = 0.0, speed_share_ = 1.0;
  double turning_damping_Nms_per_rad_, added_Nms_per_rad_ = 0.0;
  bool started_ = false, turning_limited_ = false;
  bool no_room_ = false;  // the tool's start pose is inside an object
};

}  // namespace proxarm::controller
