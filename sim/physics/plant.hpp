// Everything at the far end of the wire that obeys physics: arm, servo loops, force sensor and hand, on one clock.
//
// The devices on the bus (CANopen slaves, the sensor's protocol) sit on top: they call advance_to() with the time of a
// frame, then read encoders and gauges and set targets. Knows no bus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "sim/physics/arm_dynamics.hpp"
#include "sim/physics/clamp.hpp"
#include "sim/physics/force_sensor_model.hpp"
#include "sim/physics/gear_torque_sensor.hpp"
#include "sim/physics/hand.hpp"
#include "sim/physics/servo_loop.hpp"

namespace proxarm::sim {

// The step of the mechanics is the shortest servo period of the cell (servo_rate_Hz), 0.25 ms by default.
struct PlantConfig {
  std::int64_t finer = 1;  // steps of the mechanics in the shortest servo period; more is slower and more accurate
  std::uint64_t noise_seed = 1;
};

// In N, on the handle, at this time of the hand's own clock (negative never; 0 until it starts), where the tool is and
// as fast as it is. Called each step.
using HandForce =
    std::function<models::Vec3(double time_s, const models::Vec3& position_W, const models::Vec3& velocity_W)>;

class Plant {
 public:
  // At rest in the cell's start pose, brakes closed, drives off, at start_ns of the network's clock.
  // Throws description::SetupError (see ArmDynamics, ForceSensorModel; servo rates whose periods aren't whole
  // nanoseconds, or no multiples of the shortest).
  Plant(const description::Cell& cell, const description::SensorDescription& sensor,
        const description::HandDescription& hand, std::int64_t start_ns = 0, const PlantConfig& config = {});

  // Runs all steps up to this time (the state then is that of the last step's end, less than step_ns() before). Never
  // goes back. noexcept, no allocation.
  void advance_to(std::int64_t time_ns) noexcept;
  [[nodiscard]] std::int64_t time_ns() const noexcept { return time_ns_; }  // of the state

  [[nodiscard]] std::size_t axis_count() const noexcept { return servos_.size(); }
  [[nodiscard]] std::int64_t step_ns() const noexcept { return step_ns_; }
  // A brake opens when its servo is enabled and closes when it is disabled, brake_delay_s later: a servo that is
  // disabled by itself gives no torque meanwhile.
  [[nodiscard]] ServoLoop& servo(std::size_t axis) noexcept { return servos_[axis]; }
  void enable(std::size_t axis, std::int64_t time_ns) noexcept {
    brakes_[axis].closes_in_ns = 0;
    servos_[axis].enable(time_ns);
  }
  [[nodiscard]] const ServoLoop& servo(std::size_t axis) const noexcept { return servos_[axis]; }
  [[nodiscard]] const ForceSensorModel& force_sensor() const noexcept { return force_sensor_; }
  // What measures an axis' gear reads; 0 where nothing does.
  [[nodiscard]] std::int32_t gear_torque_counts(std::size_t axis) const noexcept {
    return gear_torques_[axis] ? gear_torques_[axis]->counts() : 0;
  }
  // From now on it repeats its last reading, or no longer does; false: this axis has none.
  bool stick_gear_torque(std::size_t axis, bool stuck) noexcept {
    if (gear_torques_[axis]) gear_torques_[axis]->stick(stuck);
    return gear_torques_[axis].has_value();
  }
  [[nodiscard]] SensorLies& sensor_lies() noexcept { return force_sensor_.lies(); }
  [[nodiscard]] ArmDynamics& arm() noexcept { return arm_; }
  [[nodiscard]] const ArmDynamics& arm() const noexcept { return arm_; }
  [[nodiscard]] const Hand& hand() const noexcept { return hand_; }

  // The hand's clock starts (its intention's time zero) when all drives are enabled for the first time, or here.
  void start_hand(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool hand_started() const noexcept { return hand_started_; }
  [[nodiscard]] std::int64_t hand_start_ns() const noexcept { return hand_start_ns_; }

  // Switches a servo off as a drive does that commands its brake: one whose setpoint rests holds the axis until the
  // brake has closed, any other loses its torque at once. Enabling it takes that back.
  void switch_off(std::size_t axis) noexcept;

  // From now on there is a body in the tool's way.
  void set_clamp(const Clamp& clamp) noexcept { clamp_ = clamp; }

  // From now on the hand pulls so; of its description only its mass counts. Precondition: `force` doesn't throw.
  void set_hand(HandForce force) { hand_force_ = std::move(force); }

  // Truth, for summaries and studies; the controller never sees it.
  [[nodiscard]] const ToolState& tool() const noexcept { return arm_.tool(); }
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return arm_.handle_force_W(); }
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return arm_.handle_torque_W(); }

 private:
  // What is left to be done by a brake.
  struct Brake {
    std::int64_t delay_ns = 0;      // of closing
    std::int64_t unpowered_ns = 0;  // since its servo had power
    std::int64_t closes_in_ns = 0;  // above 0: while its servo still holds the axis
  };

  void step() noexcept;
  void move_brake(std::size_t axis) noexcept;

  std::int64_t step_ns_;
  ArmDynamics arm_;
  Hand hand_;
  ForceSensorModel force_sensor_;
  std::vector<ServoLoop> servos_;
  std::vector<std::optional<GearTorqueSensor>> gear_torques_;  // of each axis
  std::vector<std::int64_t> servo_period_ns_;
  std::vector<Brake> brakes_;
  std::optional<Clamp> clamp_;
  HandForce hand_force_;  // empty: as the hand's description says
  std::vector<double> torque_Nm_;
  std::vector<models::Wrench> sensed_;  // on their way through the sensor, a step each; the next one is the oldest
  std::size_t next_sensed_ = 0;
  std::int64_t start_ns_, time_ns_;
  std::int64_t hand_start_ns_ = 0;
  bool hand_started_ = false;
};

}  // namespace proxarm::sim
