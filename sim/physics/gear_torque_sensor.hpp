// How a simulated drive measures the torque of its joint's gear: by strain gauges, or by a second encoder at the link.
//
//   late by delay_s → loop of hysteresis → · ratio + offset + noise → rounded to counts, cut to 16 or 32 bits
// The loop is that of a play operator: the reading stays until the torque has gone back by the loop's width. A second
// encoder reads the link's angle; offset and noise are those of the torque that is made of it.
#pragma once

#include <cstdint>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::sim {

class GearTorqueSensor {
 public:
  // Precondition: the drive has `gear_torque`. Steps are those of set().
  GearTorqueSensor(const description::DriveDescription& drive, std::int64_t step_ns, std::uint64_t seed);

  // Has always been so.
  void reset(double torque_Nm, double link_rad) noexcept;
  // Once in each step of the physics.
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
  std::vector<double> late_;  // torques or angles; the next one is the oldest
  std::size_t next_ = 0;
  double held_Nm_ = 0.0;  // in the loop of hysteresis
  std::int32_t counts_ = 0;
  bool stuck_ = false;
};

}  // namespace proxarm::sim
