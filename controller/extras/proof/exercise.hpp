// A motion about a station with measurements during the motion, for programs that need more than readings at rest.
#pragma once

#include <cstddef>
#include <span>

#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "models/arm/arm.hpp"

namespace proxarm::proof {

// The measurements of a cycle, before the cycle sends its setpoints.
struct Exercised {
  const controller::Measured& measured;
  std::span<const controller::DriveOnBus> drives;
};

// The functions are called in the cycle, so they may not allocate, lock or throw.
class Exercise {
 public:
  virtual ~Exercise() = default;

  // Returns the motors' offset from the station at this time of the exercise, rad. Precondition for implementations: at
  // time 0, and from lasts_s() on, offset and speed are zero.
  [[nodiscard]] virtual models::JointVector offset_rad(std::size_t station, double time_s) const noexcept = 0;
  [[nodiscard]] virtual double lasts_s(std::size_t station) const noexcept = 0;
  virtual void take(std::size_t station, double time_s, const Exercised& cycle) noexcept = 0;

 protected:
  Exercise() = default;
  Exercise(const Exercise&) = default;
  Exercise& operator=(const Exercise&) = default;
};

}  // namespace proxarm::proof
