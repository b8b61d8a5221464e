// The interface of a simulated drive's firmware to its motor: separates the CiA 402 part from the physics.
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

  // enable(): holds the present position and opens the brake. disable(): closes the brake, no torque.
  virtual void enable(std::int64_t time_ns) noexcept = 0;
  virtual void disable() noexcept = 0;
  // Time to reach a target, from the next target on. > 0.
  virtual void set_interpolation_period_ns(std::int64_t period_ns) noexcept = 0;
  // Reaches the target one interpolation period later. Only while enabled.
  virtual void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept = 0;
  // Applies a torque without position control, until the next target or stop(). Only while enabled.
  virtual void set_torque(double ratio) noexcept = 0;  // of the rated torque, signed like the counts
  // Decelerates to rest and holds, until the next target.
  virtual void stop(double deceleration_counts_per_s2, std::int64_t time_ns) noexcept = 0;

  [[nodiscard]] virtual std::int32_t position_counts() const noexcept = 0;
  [[nodiscard]] virtual std::int32_t demand_counts() const noexcept = 0;
  [[nodiscard]] virtual double speed_counts_per_s() const noexcept = 0;
  [[nodiscard]] virtual double torque_ratio() const noexcept = 0;  // of the rated torque
  // Reading of the gear torque sensor, as in DriveDescription::gear_torque; 0 without one.
  [[nodiscard]] virtual std::int32_t gear_torque_counts() const noexcept { return 0; }
  [[nodiscard]] virtual bool limited() const noexcept = 0;  // torque or speed at its limit
  [[nodiscard]] virtual bool at_rest() const noexcept = 0;  // of the demand
};

}  // namespace proxarm::sim
