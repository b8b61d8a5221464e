// A body clamped between the tool and a rigid obstacle, modelled as a spring that can only push:
//
//   F = −k max(0, (p − p₀)·n) n
//
// F acts on the tool at T, p is the position of T, and n points into the body. The spring has no damping, friction or
// mass: it stores all the energy put into it, k x²/2.
#pragma once

#include <algorithm>

#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct Clamp {
  models::Vec3 surface_W = models::Vec3::Zero();  // p₀, the point of first contact
  models::Vec3 normal_W = models::Vec3::UnitX();  // n, a unit vector
  double stiffness_N_per_m = 0.0;
  // true: the body presses on the handle, so the sensor measures the force; false: it presses on the arm before the
  // sensor.
  bool felt = true;

  [[nodiscard]] double depth_m(const models::Vec3& tool_W) const noexcept {
    return std::max(0.0, (tool_W - surface_W).dot(normal_W));
  }
  [[nodiscard]] models::Vec3 force_W(const models::Vec3& tool_W) const noexcept {
    return -stiffness_N_per_m * depth_m(tool_W) * normal_W;
  }
};

}  // namespace proxarm::sim
