// Computes the tool's next pose, position and orientation, from the hand's wrench.
//
// A point tool turns independently of its world, with its own inertia (orientation_proxy.hpp). A tool with a shape
// turns in its world's step (pose_world.hpp). Callers needn't know which kind of tool it is. One caller at a time.
// Nothing allocates, locks or throws after construction.
#pragma once

#include <memory>

#include "controller/proxies/orientation_proxy.hpp"
#include "controller/rendering/pose_world.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "models/arm/tool_inertia.hpp"

namespace proxarm::controller {

class RenderedTool {
 public:
  RenderedTool() = default;
  RenderedTool(const RenderedTool&) = delete;
  RenderedTool& operator=(const RenderedTool&) = delete;
  virtual ~RenderedTool() = default;

  [[nodiscard]] virtual RenderedWorld& world() noexcept = 0;

  // Starts at rest at this pose. Angles count from the orientation at the first start.
  virtual void start(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept = 0;
  // Sets the torque about the rendered point for this period; call before step(). A point tool turns at once; step()
  // reports the fault if turning has failed.
  virtual void turn(const models::Vec3& torque_W) noexcept = 0;
  // Whether the tool turns in step(); if false, the tool turns in turn().
  [[nodiscard]] virtual bool turns_in_step() const noexcept = 0;
  // Moves the tool for one period under the hand's force, like RenderedWorld. The result contains the torque of the
  // limits of turning.
  virtual WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept = 0;

  // Call if the arm couldn't follow: the proxy continues with velocity v_W from the place nearest to q_W that the scene
  // lets it reach. Returns this place. Only the second form sets orientation and angular velocity; with the first form
  // the tool turns on as before.
  virtual models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept = 0;
  models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W, const Eigen::Quaterniond& R_WT,
                      const models::Vec3& omega_W) noexcept {
    turn_to(R_WT, omega_W);
    return world().resume(q_W, v_W);
  }
  // Makes the proxy continue from R_WT with omega_W, and from its present place q_W with v_W. Returns its place.
  virtual models::Vec3 turn_on(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W, const models::Vec3& q_W,
                               const models::Vec3& v_W) noexcept = 0;

  virtual void set(const Change& change) noexcept = 0;
  // Sets the proxy's mass and the figures of the tool behind the sensor. The felt inertia doesn't change.
  virtual void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept = 0;
  virtual void set_period(double period_s) noexcept = 0;
  virtual void limit_turning(double share) noexcept = 0;  // share of the turning speed limit, 0 to 1
  virtual void add_turning_damping(double damping_Nms_per_rad) noexcept = 0;

  [[nodiscard]] virtual const Eigen::Quaterniond& R_WT() const noexcept = 0;
  [[nodiscard]] virtual models::Vec3 omega_W() const noexcept = 0;  // mean angular velocity over the last step, rad/s
  [[nodiscard]] virtual bool turns() const noexcept = 0;            // false: the orientation is held
  [[nodiscard]] virtual bool turning_limited() const noexcept = 0;  // a limit of turning was active in the last step
  [[nodiscard]] virtual TurnSets sets() const noexcept = 0;         // sets of turning for the next step
  [[nodiscard]] virtual double inertia_kg_m2() const noexcept = 0;
  // The damping of turning that the user has set.
  [[nodiscard]] virtual double own_turning_damping_Nms_per_rad() const noexcept = 0;
  // The damping of turning, added damping included.
  [[nodiscard]] virtual double turning_damping_Nms_per_rad() const noexcept = 0;
  [[nodiscard]] virtual double kinetic_J(const WorldStep& step) const noexcept = 0;

  // Returns the torque that must be added to the damping to stop turning with the time constant TurnSets::braking_s.
  [[nodiscard]] models::Vec3 braking_torque_W() const noexcept;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;

 private:
  // Sets orientation and angular velocity for the next start() or resume().
  virtual void turn_to(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept = 0;
};

class PointTool final : public RenderedTool {
 public:
  // behind_sensor_T: as in OrientationConfig; used when an inertia is set later.
  PointTool(std::unique_ptr<RenderedWorld> world, const OrientationConfig& orientation,
            models::Mat3 behind_sensor_T = models::Mat3::Zero())
      : world_(std::move(world)), orientation_(orientation), behind_sensor_T_(std::move(behind_sensor_T)) {}

  // Makes angles count from this orientation.
  void count_from(const Eigen::Quaterniond& R_WT) noexcept { orientation_.count_from(R_WT); }

  RenderedWorld& world() noexcept override { return *world_; }
  void start(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept override;
  void turn(const models::Vec3& torque_W) noexcept override { turned_ = orientation_.step(torque_W); }
  bool turns_in_step() const noexcept override { return false; }
  WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept override;
  models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept override {
    return world_->resume(q_W, v_W);
  }
  models::Vec3 turn_on(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W, const models::Vec3& q_W,
                       const models::Vec3& v_W) noexcept override;
  void set(const Change& change) noexcept override;
  void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept override;
  void set_period(double period_s) noexcept override;
  void limit_turning(double share) noexcept override { orientation_.limit_speed(share); }
  void add_turning_damping(double damping_Nms_per_rad) noexcept override {
    orientation_.add_damping(damping_Nms_per_rad);
  }
  const Eigen::Quaterniond& R_WT() const noexcept override { return orientation_.R_WT(); }
  models::Vec3 omega_W() const noexcept override { return orientation_.velocity_W(); }
  bool turns() const noexcept override { return orientation_.config().free; }
  bool turning_limited() const noexcept override {
    return orientation_.speed_limited() || orientation_.angle_limited();
  }
  TurnSets sets() const noexcept override { return orientation_.sets(); }
  double inertia_kg_m2() const noexcept override { return orientation_.config().inertia_kg_m2; }
  double own_turning_damping_Nms_per_rad() const noexcept override { return orientation_.config().damping_Nms_per_rad; }
  double turning_damping_Nms_per_rad() const noexcept override { return orientation_.damping_Nms_per_rad(); }
  double kinetic_J(const WorldStep& step) const noexcept override {
    return 0.5 * step.mass_kg * step.v_W.squaredNorm() + orientation_.kinetic_J();
  }
  void archive(fieldbus::StateArchive& state) noexcept override;

 private:
  void turn_to(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept override {
    orientation_.resume(R_WT, omega_W);
  }

  std::unique_ptr<RenderedWorld> world_;
  OrientationProxy orientation_;
  models::Mat3 behind_sensor_T_;
  ProxyFault turned_ = ProxyFault::none;
};

class RigidTool final : public RenderedTool {
 public:
  explicit RigidTool(std::unique_ptr<PoseWorld> pose) : pose_(std::move(pose)) {}

  RenderedWorld& world() noexcept override { return *pose_; }
  void start(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept override;
  void turn(const models::Vec3& torque_W) noexcept override { pose_->set_torque_W(torque_W); }
  bool turns_in_step() const noexcept override { return true; }
  WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept override {
    return pose_->step(h_W, limits);
  }
  models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept override;
  models::Vec3 turn_on(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W, const models::Vec3& q_W,
                       const models::Vec3& v_W) noexcept override;
  void set(const Change& change) noexcept override { pose_->set(change); }
  void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept override {
    pose_->hang(proxy_mass_kg, behind);
  }
  void set_period(double period_s) noexcept override { pose_->set_period(period_s); }
  void limit_turning(double share) noexcept override { pose_->limit_turning(share); }
  void add_turning_damping(double damping_Nms_per_rad) noexcept override {
    pose_->add_turning_damping(damping_Nms_per_rad);
  }
  const Eigen::Quaterniond& R_WT() const noexcept override { return pose_->orientation(); }
  models::Vec3 omega_W() const noexcept override { return pose_->angular_velocity_W(); }
  bool turns() const noexcept override { return !pose_->config().held; }
  bool turning_limited() const noexcept override { return pose_->turning_limited(); }
  TurnSets sets() const noexcept override { return pose_->sets(); }
  double inertia_kg_m2() const noexcept override { return pose_->config().inertia_kg_m2; }
  double own_turning_damping_Nms_per_rad() const noexcept override { return pose_->own_turning_damping_Nms_per_rad(); }
  double turning_damping_Nms_per_rad() const noexcept override { return pose_->config().turning_damping_Nms_per_rad; }
  double kinetic_J(const WorldStep& /*step*/) const noexcept override { return pose_->kinetic_J(); }
  void archive(fieldbus::StateArchive& state) noexcept override { pose_->archive(state); }

 private:
  void turn_to(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept override {
    pose_->turn_to(R_WT, omega_W);
  }

  std::unique_ptr<PoseWorld> pose_;
};

}  // namespace proxarm::controller
