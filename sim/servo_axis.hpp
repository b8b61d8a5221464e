// What the firmware of a simulated drive sees of its motor: the seam between the CiA 402 part and the physics.
#pragma once

#include <cstdint>

namespace proxarm::sim {

// Where the servo loop is to go, in encoder counts. Unwrapped: goes on past what 32 bits hold.
struct ServoDemand {
  double position_counts = 0.0;
  double velocity_counts_per_s = 0.0;
  double acceleration_counts_per_s2 = 0.0;
};

// A servo loop with its motor, encoder and brake. The drive hands over a demand at every tick; between ticks the physics
// moves on.
class ServoAxis {
 public:
  ServoAxis() = default;
  ServoAxis(const ServoAxis&) = delete;
  ServoAxis& operator=(const ServoAxis&) = delete;
  virtual ~ServoAxis() = default;

  // Power stage on: the loop follows the demand. Off: no torque. Switching on starts the loop without a step in torque
  // other than what the demand asks for.
  virtual void set_power(bool on) noexcept = 0;
  // The holding brake at the motor; acts at once.
  virtual void set_brake(bool engaged) noexcept = 0;
  virtual void set_demand(const ServoDemand& demand) noexcept = 0;

  // Encoder reading at the latest tick, unwrapped counts.
  [[nodiscard]] virtual std::int64_t actual_counts() const noexcept = 0;
  [[nodiscard]] virtual double actual_velocity_counts_per_s() const noexcept = 0;
  // Torque over the largest that the drive can give, −1..1; at ±1 the current limit is active.
  [[nodiscard]] virtual double torque_ratio() const noexcept = 0;
};

}  // namespace proxarm::sim
