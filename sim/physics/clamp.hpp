// A body that is caught between the tool and something that doesn't give way: a spring that only pushes.
//
//   F = −k max(0, (p − p₀)·n) n   on the tool at T (p), with n into the body
// No damping, no friction and no mass: all the energy that goes in, k x²/2, is stored.
#pragma once

#include <algorithm>

#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct Clamp {
  models::Vec3 surface_W = models::Vec3::Zero();  // p₀, where the tool meets it
  models::Vec3 normal_W = models::Vec3::UnitX();  // n, of length 1
  double stiffness_N_per_m = 0.0;
  bool felt = true;  // it presses on the handle, so the sensor feels it; else on the arm in front of the sensor

  [[nodiscard]] double depth_m(const models::Vec3& tool_W) const noexcept {
    return std::max(0.0, (tool_W - surface_W).dot(normal_W));
  }
  [[nodiscard]] models::Vec3 force_W(const models::Vec3& tool_W) const noexcept {
    return -stiffness_N_per_m * depth_m(tool_W) * normal_W;
  }
};

}  // namespace proxarm::sim
