// Motion of the impedance type: joint torques that follow from the tool's position (torque_rendering.hpp). Until
// rendering begins, the torques hold the joints where they stand. A stop is left to the drives, which bring any torque
// to zero on their slow-down ramp (6084h). This class therefore has no run-out and no hold.
//
// What the hold takes beyond the weight of the model is weight that the model lacks, seen behind a low-pass of 50 ms
// while the sensor is tared. More than 2 % of a joint's max_torque_Nm is a fault before anything moves; less is τ_0 and
// carried from the start on. So an empty device stands still where it starts, and elsewhere it is moved by what the
// model's mistake differs there, and its friction.
//
// A handle that nobody holds (handle/empty_handle.hpp) is braked at 4 m/s², then the joints are held where they are,
// with `let_go: hold` as with `rest`: the device goes on rendering, since it can't hold otherwise. The sensor's bias
// leads such a device nowhere, so no force is taken for one. But a tool whose mass isn't the model's reads as a force
// once it has turned, and lifts or drags the device as well: by τ_0 as a force at the tool, where it has turned by 60
// degrees and the tool is all that is wrong. The handle counts as empty below that, too.
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
  // `tool_mass_kg`: the mass of what hangs behind the sensor. Precondition: the arm outlives this object.
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
    models::JointVector missing_Nm;  // τ_0, as the hold has shown it so far
    models::Vec3 proxy_W = models::Vec3::Zero();
    models::Vec3 tool_k1_W = models::Vec3::Zero(), v_W = models::Vec3::Zero();  // v: behind a low-pass
    double missing_N = 0.0;                                                     // τ_0 as a force at the tool
    double braked_m_per_s = 0.0;  // the tool's bound while nobody holds it
    bool braked = false;
  };

  void hold(const Measured& measured, double share) noexcept;
  [[nodiscard]] double missing_force_N(const models::JointVector& link_rad) noexcept;
  [[nodiscard]] double largest_tool_speed(const MotionCycle& cycle) noexcept;

  std::unique_ptr<TorqueRendering> rendering_;
  const models::Arm& arm_;
  models::ToolKinematics kinematics_;
  models::JointVector max_speed_rad_per_s_, max_torque_Nm_;
  std::optional<EmptyHandle> empty_;  // none where a handle that is let go coasts
  double period_s_;
  State state_;
};

}  // namespace proxarm::controller
