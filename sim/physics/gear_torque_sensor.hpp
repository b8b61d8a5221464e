// Simulates how a drive measures the torque of its joint's gear: by strain gauges, or by a second encoder at the link.
//
//   torque → delay by delay_s → hysteresis loop → · ratio + offset + noise → rounded to counts, clamped to 16 or 32
//   bits
//
// The hysteresis loop is a play operator: after a reversal, the reading stays until the torque has changed by the width
// of the loop. A second encoder reads the link's angle; its offset and noise are given as torques.
#pragma once

#include <cstdint>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::sim {

class GearTorqueSensor {
 public:
  // `step_ns` is the interval between the calls of set(). Precondition: the drive has `gear_torque`.
  GearTorqueSensor(const description::DriveDescription& drive, std::int64_t step_ns, std::uint64_t seed);

  // Resets the sensor as if torque and angle had always had these values.
  void reset(double torque_Nm, double link_rad) noexcept;
  // Must be called once in each step of the physics.
  void set(double torque_Nm, double link_rad) noexcept;
  // While stuck, the sensor repeats its last reading.
  void stick(bool stuck) noexcept { stuck_ = stuck; }
  [[nodiscard]] std::int32_t counts() const noexcept { return counts_; }

 private:
  void read(double value) noexcept;
  [[nodiscard]] bool is_encoder() const noexcept { return sensor_.Nm_per_count == 0.0; }

  description::GearTorque sensor_;
  description::SimulatedDrive errors_;
  double stiffness_Nm_per_rad_;
  std::uint64_t seed_, number_ = 0;
  std::vector<double> late_;  // torques or angles on their way through the delay; late_[next_] is the oldest
  std::size_t next_ = 0;
  double held_Nm_ = 0.0;  // output of the play operator
  std::int32_t counts_ = 0;
  bool stuck_ = false;
};

}  // namespace proxarm::sim
