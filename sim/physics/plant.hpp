// Everything at the far end of the wire that obeys physics: arm, servo loops, force sensor and hand, on one clock.
//
// The devices on the bus (CANopen slaves, the sensor's protocol) sit on top: they call advance_to() with the time of a
// frame, then read encoders and gauges and set targets. Knows no bus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "sim/physics/arm_dynamics.hpp"
#include "sim/physics/force_sensor_model.hpp"
#include "sim/physics/hand.hpp"
#include "sim/physics/servo_loop.hpp"

namespace proxarm::sim {

// The step of the mechanics is the shortest servo period of the cell (servo_rate_Hz), 0.25 ms by default.
struct PlantConfig {
  std::int64_t finer = 1;  // steps of the mechanics in the shortest servo period; more is slower and more accurate
  std::uint64_t noise_seed = 1;
};

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
  // A brake opens when its servo is enabled and closes when it is disabled.
  [[nodiscard]] ServoLoop& servo(std::size_t axis) noexcept { return servos_[axis]; }
  [[nodiscard]] const ServoLoop& servo(std::size_t axis) const noexcept { return servos_[axis]; }
  [[nodiscard]] const ForceSensorModel& force_sensor() const noexcept { return force_sensor_; }
  [[nodiscard]] SensorLies& sensor_lies() noexcept { return force_sensor_.lies(); }
  [[nodiscard]] ArmDynamics& arm() noexcept { return arm_; }
  [[nodiscard]] const ArmDynamics& arm() const noexcept { return arm_; }
  [[nodiscard]] const Hand& hand() const noexcept { return hand_; }

  // The hand's clock starts (its intention's time zero) when all drives are enabled for the first time, or here.
  void start_hand(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool hand_started() const noexcept { return hand_started_; }
  [[nodiscard]] std::int64_t hand_start_ns() const noexcept { return hand_start_ns_; }

  // Truth, for summaries and studies; the controller never sees it.
  [[nodiscard]] const ToolState& tool() const noexcept { return arm_.tool(); }
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return arm_.handle_force_W(); }

 private:
  void step() noexcept;

  std::int64_t step_ns_;
  ArmDynamics arm_;
  Hand hand_;
  ForceSensorModel force_sensor_;
  std::vector<ServoLoop> servos_;
  std::vector<std::int64_t> servo_period_ns_;
  std::vector<double> torque_Nm_;
  std::vector<models::Wrench> sensed_;  // on their way through the sensor, a step each; the next one is the oldest
  std::size_t next_sensed_ = 0;
  std::int64_t start_ns_, time_ns_;
  std::int64_t hand_start_ns_ = 0;
  bool hand_started_ = false;
};

}  // namespace proxarm::sim
