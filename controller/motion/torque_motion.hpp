// Makes the motion of the impedance type: joint torques computed from the tool's position (torque_rendering.hpp).
// Before rendering, torques hold the joints in place. A drive that stops ramps its torque to zero by itself (6084h), so
// this class has neither run-out nor hold.
//
// During the tare, the holding torque less the model's weight, low-passed with 50 ms, is the torque of weight that the
// model lacks. If this torque exceeds 2 % of a joint's max_torque_Nm, a fault is raised before anything moves. A
// smaller torque becomes τ_0, which is compensated from the start on, so an empty device stands still in its start
// pose. In other poses the model's error is different, and the difference, less friction, moves the device.
//
// When nobody holds the handle (handle/empty_handle.hpp), the device is braked at 4 m/s². Then its joints are held in
// place while rendering continues. `let_go: hold` acts like `let_go: rest`. The sensor's bias can't move a device of
// the impedance type, so no force counts as a bias. But if the tool's mass differs from the model's, the sensor reads a
// force after the tool has turned, and the missing weight lifts or drags the device. If the tool has turned by 60
// degrees and only the tool's mass is wrong, this force equals τ_0, expressed as a force at the tool. So the handle
// also counts as empty below that force.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "controller/handle/empty_handle.hpp"
#include "controller/motion/motion.hpp"
#include "controller/rendering/torque_rendering.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

class TorqueMotion final : public Motion {
 public:
  // tool_mass_kg: mass of everything behind the sensor. Precondition: the arm outlives this object.
  TorqueMotion(std::unique_ptr<TorqueRendering> rendering, const models::Arm& arm,
               const std::vector<description::DriveDescription>& drives,
               const description::SupervisionDescription& supervision, double tool_mass_kg, double period_s);

  void wait_for_drives(const Measured& measured) noexcept override;
  void stand(const Measured& measured) noexcept override;
  bool render(const MotionCycle& cycle) noexcept override;
  bool free(const MotionCycle& /*cycle*/) noexcept override { return true; }
  void run_out() noexcept override {}

  void start(const Measured& measured, Beginning beginning) noexcept override;
  void start_run_out() noexcept override {}
  bool prepare_freeing(const Command& /*command*/, const Measured& /*measured*/) noexcept override { return false; }
  void set(const Change& /*change*/) noexcept override {}
  void set_period(double /*period_s*/) noexcept override {}  // torques are made for one timestep

  [[nodiscard]] Setpoints setpoints() const noexcept override {
    return {Setpoints::Kind::torques_Nm, state_.torque_Nm};
  }
  [[nodiscard]] bool can_hold() const noexcept override { return false; }
  [[nodiscard]] bool stands() const noexcept override { return true; }
  [[nodiscard]] bool backs_off() const noexcept override { return false; }
  [[nodiscard]] std::optional<MissingWeight> missing_weight() const noexcept override;
  [[nodiscard]] const models::Vec3& proxy_W() const noexcept override { return state_.proxy_W; }

  void archive(fieldbus::StateArchive& state) noexcept override {
    rendering_->archive(state);
    if (empty_) empty_->archive(state);
    archive_fields(state, state_);
  }

 private:
  struct State {
    models::JointVector torque_Nm;
    models::JointVector missing_Nm;  // τ_0, as measured so far while the joints are held
    models::Vec3 proxy_W = models::Vec3::Zero();
    // The tool's place in the last cycle; the tool's velocity, low-passed.
    models::Vec3 tool_k1_W = models::Vec3::Zero(), v_W = models::Vec3::Zero();
    double missing_N = 0.0;       // τ_0 as a force at the tool
    double braked_m_per_s = 0.0;  // speed bound of the tool while nobody holds the handle
    bool braked = false;
  };

  void hold(const Measured& measured, double share) noexcept;
  [[nodiscard]] double missing_force_N(const models::JointVector& link_rad) noexcept;
  [[nodiscard]] double largest_tool_speed(const MotionCycle& cycle) noexcept;

  std::unique_ptr<TorqueRendering> rendering_;
  const models::Arm& arm_;
  models::ToolKinematics kinematics_;
  models::JointVector max_speed_rad_per_s_, max_torque_Nm_;
  std::optional<EmptyHandle> empty_;  // nullopt: a released handle coasts
  double period_s_;
  State state_;
};

}  // namespace proxarm::controller
