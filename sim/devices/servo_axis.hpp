// The interface between a simulated drive's firmware and its motor. It separates the CiA 402 part from the physics.
#pragma once

#include <cstdint>

namespace proxarm::sim {

// A servo loop with motor, encoder, brake and interpolation of targets, in encoder counts. Readings are those of the
// latest step of the physics.
class ServoAxis {
 public:
  ServoAxis() = default;
  ServoAxis(const ServoAxis&) = delete;
  ServoAxis& operator=(const ServoAxis&) = delete;
  virtual ~ServoAxis() = default;

  // enable() holds the current position and opens the brake. disable() ends the torque and closes the brake.
  virtual void enable(std::int64_t time_ns) noexcept = 0;
  virtual void disable() noexcept = 0;
  // Sets the time to reach a target, from the next target on. Precondition: period_ns > 0.
  virtual void set_interpolation_period_ns(std::int64_t period_ns) noexcept = 0;
  // Makes the axis reach the target one interpolation period later. Precondition: the axis is enabled.
  virtual void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept = 0;
  // Applies a torque without position control, until the next target or stop(). `ratio` is the share of the rated
  // torque, with the sign of the counts. Precondition: the axis is enabled.
  virtual void set_torque(double ratio) noexcept = 0;
  // Decelerates to rest and holds the axis until the next target.
  virtual void stop(double deceleration_counts_per_s2, std::int64_t time_ns) noexcept = 0;

  [[nodiscard]] virtual std::int32_t position_counts() const noexcept = 0;
  [[nodiscard]] virtual std::int32_t demand_counts() const noexcept = 0;
  [[nodiscard]] virtual double speed_counts_per_s() const noexcept = 0;
  [[nodiscard]] virtual double torque_ratio() const noexcept = 0;  // share of the rated torque
  // Returns the reading of the gear torque sensor, as in DriveDescription::gear_torque; 0 if there is no such sensor.
  [[nodiscard]] virtual std::int32_t gear_torque_counts() const noexcept { return 0; }
  [[nodiscard]] virtual bool limited() const noexcept = 0;  // torque or speed is at its limit
  [[nodiscard]] virtual bool at_rest() const noexcept = 0;  // the demand is at rest
};

}  // namespace proxarm::sim
