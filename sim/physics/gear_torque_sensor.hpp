// Simulates how a drive measures the torque of its joint's gear: by strain gauges, or by a second encoder at the link.
//
//   delay of delay_s → hysteresis loop → · ratio + offset + noise → rounded to counts, clamped to 16 or 32 bits
// The hysteresis is a play operator: the reading stays until the torque has gone back by the loop's width. A second
// encoder reads the link's angle; its offset and noise are given as torque.
#pragma once

#include <cstdint>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::sim {

class GearTorqueSensor {
 public:
  // Precondition: the drive has `gear_torque`. `step_ns`: interval of set().
  GearTorqueSensor(const description::DriveDescription& drive, std::int64_t step_ns, std::uint64_t seed);

  // As if torque and angle had always had these values.
  void reset(double torque_Nm, double link_rad) noexcept;
  // Call once in each step of the physics.
  void set(double torque_Nm, double link_rad) noexcept;
  void stick(bool stuck) noexcept { stuck_ = stuck; }  // at its present reading
  [[nodiscard]] std::int32_t counts() const noexcept { return counts_; }

 private:
  void read(double value) noexcept;
  [[nodiscard]] bool is_encoder() const noexcept { return sensor_.Nm_per_count == 0.0; }

  description::GearTorque sensor_;
  description::SimulatedDrive errors_;
  double stiffness_Nm_per_rad_;
  std::uint64_t seed_, number_ = 0;
  std::vector<double> late_;  // delayed torques or angles; the next one is the oldest
  std::size_t next_ = 0;
  double held_Nm_ = 0.0;  // output of the play operator
  std::int32_t counts_ = 0;
  bool stuck_ = false;
};

}  // namespace proxarm::sim
