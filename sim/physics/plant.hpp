// All simulated physics on one clock: arm, servo loops, force sensor and hand.
//
// The devices on the bus (CANopen slaves, force sensor) use it: they call advance_to() with the time of a frame, then
// read encoders and gauges and set targets. Plant itself knows no bus.
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

// The step of the mechanics is the cell's shortest servo period (servo_rate_Hz; 0.25 ms by default) divided by `finer`.
struct PlantConfig {
  std::int64_t finer = 1;  // a larger divisor is slower and more accurate
  std::uint64_t noise_seed = 1;
};

// Returns the force on the handle in N; called in each step. time_s is the time on the hand's clock: 0 until the clock
// starts, never negative.
using HandForce =
    std::function<models::Vec3(double time_s, const models::Vec3& position_W, const models::Vec3& velocity_W)>;

class Plant {
 public:
  // Starts at start_ns of the network's clock: the arm is at rest in the cell's start pose, the brakes are closed and
  // the drives are off. Throws description::SetupError as ArmDynamics and ForceSensorModel do; also if a servo period
  // isn't a whole number of nanoseconds or isn't a multiple of the shortest servo period.
  Plant(const description::Cell& cell, const description::SensorDescription& sensor,
        const description::HandDescription& hand, std::int64_t start_ns = 0, const PlantConfig& config = {});

  // Runs all steps up to time_ns. The state is then that of the last step, which is less than step_ns() before time_ns.
  // Time never steps back. Allocates nothing.
  void advance_to(std::int64_t time_ns) noexcept;
  [[nodiscard]] std::int64_t time_ns() const noexcept { return time_ns_; }  // time of the state

  [[nodiscard]] std::size_t axis_count() const noexcept { return servos_.size(); }
  [[nodiscard]] std::int64_t step_ns() const noexcept { return step_ns_; }
  // A brake opens when its servo is enabled. It closes brake_delay_s after its servo is disabled. A servo that was
  // disabled by disable() gives no torque while its brake closes.
  [[nodiscard]] ServoLoop& servo(std::size_t axis) noexcept { return servos_[axis]; }
  void enable(std::size_t axis, std::int64_t time_ns) noexcept {
    brakes_[axis].closes_in_ns = 0;
    servos_[axis].enable(time_ns);
  }
  [[nodiscard]] const ServoLoop& servo(std::size_t axis) const noexcept { return servos_[axis]; }
  [[nodiscard]] const ForceSensorModel& force_sensor() const noexcept { return force_sensor_; }
  // Returns the reading of the axis' gear torque sensor; 0 if the axis has no such sensor.
  [[nodiscard]] std::int32_t gear_torque_counts(std::size_t axis) const noexcept {
    return gear_torques_[axis] ? gear_torques_[axis]->counts() : 0;
  }
  // Makes the axis' gear torque sensor repeat its last reading (true) or measure again (false). Returns false if the
  // axis has no such sensor.
  bool stick_gear_torque(std::size_t axis, bool stuck) noexcept {
    if (gear_torques_[axis]) gear_torques_[axis]->stick(stuck);
    return gear_torques_[axis].has_value();
  }
  [[nodiscard]] SensorLies& sensor_lies() noexcept { return force_sensor_.lies(); }
  [[nodiscard]] ArmDynamics& arm() noexcept { return arm_; }
  [[nodiscard]] const ArmDynamics& arm() const noexcept { return arm_; }
  [[nodiscard]] const Hand& hand() const noexcept { return hand_; }

  // Starts the hand's clock, that is, sets time zero of the hand's intention. Without this call, the clock starts when
  // all drives are enabled for the first time.
  void start_hand(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool hand_started() const noexcept { return hand_started_; }
  [[nodiscard]] std::int64_t hand_start_ns() const noexcept { return hand_start_ns_; }

  // Switches a servo off in the same way as a drive that controls its brake. If the servo's setpoint rests, the servo
  // holds the axis until the brake has closed; else its torque ends at once. Enabling the servo cancels this.
  void switch_off(std::size_t axis) noexcept;

  // Puts a body in the way of the tool from now on.
  void set_clamp(const Clamp& clamp) noexcept { clamp_ = clamp; }

  // Replaces the hand's force from now on; the hand's description then gives only the mass and the torque.
  // Precondition: `force` doesn't throw.
  void set_hand(HandForce force) { hand_force_ = std::move(force); }

  // True values for summaries and studies. The controller never sees them.
  [[nodiscard]] const ToolState& tool() const noexcept { return arm_.tool(); }
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return arm_.handle_force_W(); }
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return arm_.handle_torque_W(); }

 private:
  struct Brake {
    std::int64_t delay_ns = 0;      // closing delay
    std::int64_t unpowered_ns = 0;  // time since the servo lost its power
    // If > 0: remaining time in which the servo still holds the axis.
    std::int64_t closes_in_ns = 0;
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
  HandForce hand_force_;  // empty: the hand's description gives the force
  std::vector<double> torque_Nm_;
  // Wrenches on their way through the sensor's delay, one per step; sensed_[next_sensed_] is the oldest.
  std::vector<models::Wrench> sensed_;
  std::size_t next_sensed_ = 0;
  std::int64_t start_ns_, time_ns_;
  std::int64_t hand_start_ns_ = 0;
  bool hand_started_ = false;
};

}  // namespace proxarm::sim
