// A half-space as an obstacle: (2) and (4), with or without an elastic layer.
#pragma once

#include <cmath>
#include <stdexcept>

#include "models/obstacles/obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

class PlaneObstacle final : public Obstacle {
 public:
  // Throws std::invalid_argument if the normal has no direction, or if the friction isn't finite or is negative.
  PlaneObstacle(const Vec3& point_m, const Vec3& normal, double friction, const Layer& layer = {})
      : surface_(point_m, normal), mu_(friction), layer_(layer) {
    if (!std::isfinite(friction) || !(friction >= 0.0)) {
      throw std::invalid_argument("a friction coefficient must be finite and not negative");
    }
  }

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override {
    const FaceStep<3> s = step_on_layer(surface_, mu_, layer_, K, p, q);
    return {s.r, surface_.normal(), 0, s.touches, s.slips};
  }

  [[nodiscard]] Layer layer() const noexcept override { return layer_; }
  [[nodiscard]] bool presses_at(const Vec3& r) const noexcept override {
    return layer_.soft() && surface_.height(r) < -surface_.rounding(r);
  }
  [[nodiscard]] bool excludes(const Vec3& /*q*/, const Vec3& r) const noexcept override {
    return surface_.height(r) < -slack_ * surface_.rounding(r) - (layer_.soft() ? layer_.thickness_m : 0.0);
  }

  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override { return excludes(x, y); }

  [[nodiscard]] Tangent tangent(const Vec3& /*r*/, std::int32_t /*feature*/) const noexcept override {
    return {surface_, mu_};
  }
  [[nodiscard]] double distance(const Vec3& x) const noexcept override { return surface_.height(x); }
  void set_friction(double friction) noexcept override { mu_ = friction; }
  // Sets how far a point may be behind the surface, in units of rounding(). For a single surface it is 1. For a plane
  // guide, which is two half-spaces back to back, it is about 8: a point on one half-space is behind the other
  // half-space by the rounding of both. Beyond 500 (1e-12 m within a metre of the origin), the contract's "never
  // inside" would fail.
  void set_slack(double roundings) noexcept { slack_ = roundings; }
  [[nodiscard]] Bounds bounds() const noexcept override { return {}; }

 private:
  FlatSurface<3> surface_;
  double mu_;
  Layer layer_;
  double slack_ = 1.0;
};

}  // namespace proxarm::models
