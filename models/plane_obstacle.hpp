// A half-space among other obstacles: (2) and (4), with an elastic layer if there is one.
#pragma once

#include <cmath>
#include <stdexcept>

#include "models/friction_plane.hpp"
#include "models/round_obstacle.hpp"

namespace proxarm::models {

class PlaneObstacle final : public Obstacle {
 public:
  // Throws std::invalid_argument as FrictionPlane does.
  PlaneObstacle(const Vec3& point_m, const Vec3& normal, double friction, const Layer& layer = {})
      : surface_(point_m, normal), mu_(friction), layer_(layer) {
    if (!std::isfinite(friction) || !(friction >= 0.0)) {
      throw std::invalid_argument("a friction coefficient must be finite and not negative");
    }
  }

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override {
    const Vec3& n = surface_.normal();
    if (!layer_.soft()) {
      const FaceStep<3> s = step_on_face(surface_, mu_, p, q);
      return {s.r, n, 0, s.touches, s.slips};
    }
    const double h_p = surface_.height(p);
    if (h_p > 0.0) return {p, n, 0, false, false};
    // K (h − h_p) = −k h along the normal, no deeper than the layer; then (4) along the tangent with f_n = K (h − h_p).
    const double k = layer_.stiffness_N_per_m;
    const double h = std::max(K * h_p / (K + k), -layer_.thickness_m);
    const Vec3 p_t = p + n * (h - h_p), q_t = q + n * (h - surface_.height(q)), d = p_t - q_t;
    const double distance = d.norm(), reach = mu_ * (h - h_p);
    if (!(distance > reach)) return {(q_t - q).norm() <= surface_.rounding(q) ? q : q_t, n, 0, true, false};
    return {p_t - (reach / distance) * d, n, 0, true, mu_ > 0.0};
  }

  [[nodiscard]] bool excludes(const Vec3& /*q*/, const Vec3& r) const noexcept override {
    return surface_.height(r) < -surface_.rounding(r) - (layer_.soft() ? layer_.thickness_m : 0.0);
  }

  [[nodiscard]] Tangent tangent(const Vec3& /*r*/, std::int32_t /*feature*/) const noexcept override {
    return {surface_, mu_};
  }
  [[nodiscard]] double distance(const Vec3& x) const noexcept override { return surface_.height(x); }
  [[nodiscard]] Bounds bounds() const noexcept override { return {}; }

 private:
  FlatSurface<3> surface_;
  double mu_;
  Layer layer_;
};

}  // namespace proxarm::models
