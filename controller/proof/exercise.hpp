// A motion about a station with measurements during the motion, for callers that need more than readings at rest.
#pragma once

#include <cstddef>
#include <span>

#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "models/arm/arm.hpp"

namespace proxarm::proof {

// The cycle's measurements, before it sends its setpoints.
struct Exercised {
  const controller::Measured& measured;
  std::span<const controller::DriveOnBus> drives;
};

// Called in the cycle: must not allocate, lock or throw.
class Exercise {
 public:
  virtual ~Exercise() = default;

  // The motors' offset from the station at this time of the exercise, rad. Zero and at rest at time 0 and from
  // lasts_s() on.
  [[nodiscard]] virtual models::JointVector offset_rad(std::size_t station, double time_s) const noexcept = 0;
  [[nodiscard]] virtual double lasts_s(std::size_t station) const noexcept = 0;
  virtual void take(std::size_t station, double time_s, const Exercised& cycle) noexcept = 0;

 protected:
  Exercise() = default;
  Exercise(const Exercise&) = default;
  Exercise& operator=(const Exercise&) = default;
};

}  // namespace proxarm::proof
