// What the firmware of a simulated drive sees of its motor: the seam between the CiA 402 part and the physics.
#pragma once

#include <cstdint>

namespace proxarm::sim {

// A servo loop with its motor, encoder, brake and the interpolation of targets, in encoder counts. Readings are those
// of the latest step of the physics.
class ServoAxis {
 public:
  ServoAxis() = default;
  ServoAxis(const ServoAxis&) = delete;
  ServoAxis& operator=(const ServoAxis&) = delete;
  virtual ~ServoAxis() = default;

  // Power on: holds the present position, and the brake opens. Off: the brake closes, no torque.
  virtual void enable(std::int64_t time_ns) noexcept = 0;
  virtual void disable() noexcept = 0;
  // From a target to where it is reached; with effect from the next target on. More than 0.
  virtual void set_interpolation_period_ns(std::int64_t period_ns) noexcept = 0;
  // Go to it, to be there one interpolation period later. Only while enabled.
  virtual void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept = 0;
  // From now on this torque, and no control of the position, until the next target or stop(). Only while enabled.
  virtual void set_torque(double ratio) noexcept = 0;  // of the rated torque, by the sense of the counts
  // Slow down to rest and hold, until the next target.
  virtual void stop(double deceleration_counts_per_s2, std::int64_t time_ns) noexcept = 0;

  [[nodiscard]] virtual std::int32_t position_counts() const noexcept = 0;
  [[nodiscard]] virtual std::int32_t demand_counts() const noexcept = 0;
  [[nodiscard]] virtual double speed_counts_per_s() const noexcept = 0;
  [[nodiscard]] virtual double torque_ratio() const noexcept = 0;  // of the rated torque
  // What measures the gear's torque reads, as DriveDescription::gear_torque has it; 0 where nothing does.
  [[nodiscard]] virtual std::int32_t gear_torque_counts() const noexcept { return 0; }
  [[nodiscard]] virtual bool limited() const noexcept = 0;  // torque or speed is at its limit
  [[nodiscard]] virtual bool at_rest() const noexcept = 0;  // the demand
};

}  // namespace proxarm::sim
