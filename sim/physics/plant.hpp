// All the simulated physics on one clock: arm, servo loops, force sensor and hand.
//
// The devices on the bus use it (CANopen slaves, the sensor's protocol): they call advance_to() with the time of a
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

// The mechanics' step is the cell's shortest servo period (servo_rate_Hz), 0.25 ms by default, divided by `finer`.
struct PlantConfig {
  std::int64_t finer = 1;  // more is slower and more accurate
  std::uint64_t noise_seed = 1;
};

// Force on the handle in N, called each step. time_s is on the hand's clock: 0 until it starts, never negative.
using HandForce =
    std::function<models::Vec3(double time_s, const models::Vec3& position_W, const models::Vec3& velocity_W)>;

class Plant {
 public:
  // Starts at rest in the cell's start pose, brakes closed, drives off, at start_ns of the network's clock. Throws
  // description::SetupError (see ArmDynamics, ForceSensorModel; also for servo periods that aren't whole nanoseconds,
  // or no multiples of the shortest).
  Plant(const description::Cell& cell, const description::SensorDescription& sensor,
        const description::HandDescription& hand, std::int64_t start_ns = 0, const PlantConfig& config = {});

  // Runs all steps up to this time; the state is then that of the last step, less than step_ns() before. Never goes
  // back. noexcept, no allocation.
  void advance_to(std::int64_t time_ns) noexcept;
  [[nodiscard]] std::int64_t time_ns() const noexcept { return time_ns_; }  // time of the state

  [[nodiscard]] std::size_t axis_count() const noexcept { return servos_.size(); }
  [[nodiscard]] std::int64_t step_ns() const noexcept { return step_ns_; }
  // A brake opens when its servo is enabled, and closes brake_delay_s after it is disabled. In between, a servo that
  // was disabled by disable() gives no torque.
  [[nodiscard]] ServoLoop& servo(std::size_t axis) noexcept { return servos_[axis]; }
  void enable(std::size_t axis, std::int64_t time_ns) noexcept {
    brakes_[axis].closes_in_ns = 0;
    servos_[axis].enable(time_ns);
  }
  [[nodiscard]] const ServoLoop& servo(std::size_t axis) const noexcept { return servos_[axis]; }
  [[nodiscard]] const ForceSensorModel& force_sensor() const noexcept { return force_sensor_; }
  // Reading of the axis' gear torque sensor; 0 if it has none.
  [[nodiscard]] std::int32_t gear_torque_counts(std::size_t axis) const noexcept {
    return gear_torques_[axis] ? gear_torques_[axis]->counts() : 0;
  }
  // Makes that sensor repeat its last reading, or ends that; false if the axis has none.
  bool stick_gear_torque(std::size_t axis, bool stuck) noexcept {
    if (gear_torques_[axis]) gear_torques_[axis]->stick(stuck);
    return gear_torques_[axis].has_value();
  }
  [[nodiscard]] SensorLies& sensor_lies() noexcept { return force_sensor_.lies(); }
  [[nodiscard]] ArmDynamics& arm() noexcept { return arm_; }
  [[nodiscard]] const ArmDynamics& arm() const noexcept { return arm_; }
  [[nodiscard]] const Hand& hand() const noexcept { return hand_; }

  // Starts the hand's clock (time zero of its intention), which otherwise starts when all drives are first enabled.
  void start_hand(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool hand_started() const noexcept { return hand_started_; }
  [[nodiscard]] std::int64_t hand_start_ns() const noexcept { return hand_start_ns_; }

  // Switches a servo off as a drive does that controls its brake: if its setpoint rests, it holds the axis until the
  // brake has closed, else its torque ends at once. Enabling it cancels this.
  void switch_off(std::size_t axis) noexcept;

  // Puts a body into the tool's way from now on.
  void set_clamp(const Clamp& clamp) noexcept { clamp_ = clamp; }

  // Replaces the hand's force from now on; its description then only gives the mass. Precondition: `force` doesn't
  // throw.
  void set_hand(HandForce force) { hand_force_ = std::move(force); }

  // True values for summaries and studies; the controller never sees them.
  [[nodiscard]] const ToolState& tool() const noexcept { return arm_.tool(); }
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return arm_.handle_force_W(); }
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return arm_.handle_torque_W(); }

 private:
  struct Brake {
    std::int64_t delay_ns = 0;      // closing delay
    std::int64_t unpowered_ns = 0;  // time since its servo lost power
    std::int64_t closes_in_ns = 0;  // > 0: remaining time in which the servo still holds the axis
  };

  void step() noexcept;
  void move_brake(std::size_t axis) noexcept;

  std::int64_t step_ns_;
  ArmDynamics arm_;
  Hand hand_;
  ForceSensorModel force_sensor_;
  std::vector<ServoLoop> servos_;
  std::vector<std::optional<GearTorqueSensor>> gear_torques_;
  std::vector<std::int64_t> servo_period_ns_;
  std::vector<Brake> brakes_;
  std::optional<Clamp> clamp_;
  HandForce hand_force_;  // empty: force by the hand's description
  std::vector<double> torque_Nm_;
  std::vector<models::Wrench> sensed_;  // wrenches delayed by the sensor, one per step; the next one is the oldest
  std::size_t next_sensed_ = 0;
  std::int64_t start_ns_, time_ns_;
  std::int64_t hand_start_ns_ = 0;
  bool hand_started_ = false;
};

}  // namespace proxarm::sim
