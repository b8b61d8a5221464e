// Motion of the impedance type: joint torques that follow from the tool's position (torque_rendering.hpp). Until
// rendering begins, the torques hold the tool where it stands. A stop is left to the drives, which bring any torque to
// zero on their slow-down ramp (6084h). This class therefore has no run-out and no hold.
#pragma once

#include <memory>
#include <vector>

#include "controller/motion/motion.hpp"
#include "controller/rendering/torque_rendering.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

class TorqueMotion final : public Motion {
 public:
  TorqueMotion(std::unique_ptr<TorqueRendering> rendering, const models::Arm& arm,
               const std::vector<description::DriveDescription>& drives, double period_s);

  void wait_for_drives(const Measured& measured) noexcept override { hold(measured); }
  void stand(const Measured& measured) noexcept override { hold(measured); }
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
  [[nodiscard]] const models::Vec3& proxy_W() const noexcept override { return state_.proxy_W; }

  void archive(fieldbus::StateArchive& state) noexcept override {
    rendering_->archive(state);
    archive_fields(state, state_);
  }

 private:
  struct State {
    models::JointVector torque_Nm;
    models::Vec3 proxy_W = models::Vec3::Zero();
  };

  void hold(const Measured& measured) noexcept;

  std::unique_ptr<TorqueRendering> rendering_;
  models::JointVector max_speed_rad_per_s_;
  double period_s_;
  State state_;
};

}  // namespace proxarm::controller
