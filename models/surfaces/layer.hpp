// Renders an elastic layer on a flat surface: the layer yields by the normal force divided by its stiffness k, down to
// a rigid core.
//
//   K (h − h_p) = −k h        along the normal; h and h_p are the heights of r and p; −h ≤ the layer's thickness
//   (4) along the tangent     with the normal force K (h − h_p)
//
// The layer's force at r is the same for every K, so Assumption 1 holds.
#pragma once

#include <algorithm>
#include <limits>

#include "models/surfaces/friction_plane.hpp"

namespace proxarm::models {

struct Layer {
  double stiffness_N_per_m = std::numeric_limits<double>::infinity();  // infinite: there is no layer
  double thickness_m = 0.0;

  [[nodiscard]] bool soft() const noexcept { return thickness_m > 0.0; }
};

// Makes one step on a flat surface with or without a layer.
inline FaceStep<3> step_on_layer(const FlatSurface<3>& surface, double mu, const Layer& layer, double K, const Vec3& p,
                                 const Vec3& q) noexcept {
  if (!layer.soft()) return step_on_face(surface, mu, p, q);
  const Vec3& n = surface.normal();
  const double h_p = surface.height(p);
  if (h_p > 0.0) return {p, false, false};
  const double k = layer.stiffness_N_per_m;
  const double h = std::max(K * h_p / (K + k), -layer.thickness_m);
  const Vec3 p_t = p + n * (h - h_p), q_t = q + n * (h - surface.height(q)), d = p_t - q_t;
  const double distance = d.norm(), reach = mu * (h - h_p);
  if (!(distance > reach)) return {(q_t - q).norm() <= surface.rounding(q) ? q : q_t, true, false};
  return {p_t - (reach / distance) * d, true, mu > 0.0};
}

}  // namespace proxarm::models
