// Computes the world's force for the error study's penalty methods, which replace ℳ by springs, dampers and friction
// dampers.
//
// A wall pushes in proportion to the depth and to the speed into the wall, and never pulls. Friction is a damper up to
// the force μ f_n. Distances, normals and derivatives of the plane or sphere are in closed form, so a step does no
// unnecessary work.
#pragma once

#include <vector>

#include "controller/extras/studies/error/error_cases.hpp"

namespace proxarm::studies {

// The parameters of a penalty method.
struct Tuning {
  double stiffness_N_per_m = 0.0, damping_ratio = 0.0, friction_slope = 1.0;
  // Whether velocities belong to times half a step before the positions' times, as in leapfrog.
  bool staggered = false;

  bool operator==(const Tuning&) const = default;
};

class PenaltyWorld {
 public:
  PenaltyWorld(const ErrorCase& which, const Tuning& tuning);

  // Returns the force on the tool at q with velocity v.
  [[nodiscard]] models::Vec3 force(const models::Vec3& q, const models::Vec3& v) const noexcept;

  // Returns the force on the tool at q₀ + T v with velocity v. Sets `slope` to the force's derivative with respect to
  // v.
  [[nodiscard]] models::Vec3 force(const models::Vec3& q_0, double T, const models::Vec3& v,
                                   models::Mat3& slope) const noexcept;

 private:
  struct Touch;
  [[nodiscard]] static Touch touch(const CaseSurface& surface, const models::Vec3& q) noexcept;
  void press(const Touch& at, double T, const models::Vec3& v, models::Vec3& f, models::Mat3* slope) const noexcept;

  std::vector<CaseSurface> surfaces_;
  double mu_, medium_, k_, c_ = 0.0, c_t_ = 0.0;
};

}  // namespace proxarm::studies
