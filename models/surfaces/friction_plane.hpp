// Renders a flat wall with Coulomb friction, equation (4).
//
//   𝒢(K, p, q) = p                                                   if nᵀp > 0
//                q_sf                                                if nᵀp ≤ 0 ∧ ‖p_sf − q_sf‖ ≤ −μ nᵀp
//                p_sf + μ nᵀp (p_sf − q_sf)/‖p_sf − q_sf‖            if nᵀp ≤ 0 ∧ ‖p_sf − q_sf‖ > −μ nᵀp      (4)
//
//   p_sf = p − n nᵀp,   q_sf = q − n nᵀq
//
// p and q are relative to a point of the surface. ℳ is (17). K doesn't appear, because penetration and the reach of
// friction are both forces divided by K. A proxy that is on the surface (within rounding) and sticks is returned
// unchanged, bit for bit, so that it never creeps.
#pragma once

#include <cmath>
#include <stdexcept>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

// The result of a step on one surface.
template <int N>
struct FaceStep {
  Vec<N> r;  // p itself if the proxy doesn't touch the surface
  bool touches = false;
  bool slips = false;
};

template <int N>
FaceStep<N> step_on_face(const FlatSurface<N>& surface, double mu, const Vec<N>& p, const Vec<N>& q) noexcept {
  const Vec<N>& n = surface.normal();
  const double n_p = surface.height(p);     // nᵀp
  if (n_p > 0.0) return {p, false, false};  // (4), first case
  // The surface is a point, so the proxy can't slip.
  if constexpr (N == 1) return {surface.point(), true, false};

  const Vec<N> p_sf = p - n * n_p;
  const double n_q = surface.height(q);
  const bool on_surface = std::abs(n_q) <= surface.rounding(q);
  const Vec<N> q_sf = on_surface ? q : Vec<N>(q - n * n_q);
  const Vec<N> d = p_sf - q_sf;
  const double distance2 = d.squaredNorm(), reach = -mu * n_p;
  // The condition is "not greater", so that the proxy sticks if distance2 underflows, and no step divides by zero.
  if (!(distance2 > reach * reach))
    return {on_surface ? q : surface.projection(q_sf), true, false};  // (4), second case

  const Vec<N> r = p_sf - (reach / std::sqrt(distance2)) * d;  // (4), third case
  // If p is deeper than the scene is wide, the rounding of n_p leaves r off the surface; a second projection puts r
  // onto it.
  if (-n_p > 1e-3 + surface.size() + q.template lpNorm<1>()) return {surface.projection(r), true, mu > 0.0};
  return {r, true, mu > 0.0};
}

template <int N>
class FrictionPlane final : public GeometricAlgorithm<N> {
 public:
  // Throws std::invalid_argument if the normal has no direction, or if the friction coefficient isn't finite or is
  // negative. For μ = 0, (4) equals (2); Plane is then cheaper.
  FrictionPlane(const Vec<N>& point_m, const Vec<N>& normal, double friction)
      : surface_(point_m, normal), mu_(friction) {
    if (!std::isfinite(friction) || !(friction >= 0.0)) {
      throw std::invalid_argument("a friction coefficient must be finite and not negative");
    }
    contact_.normal = surface_.normal();
  }

  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const FaceStep<N> step = step_on_face(surface_, mu_, p, q);
    touches_ = step.touches;
    contact_.slips = step.slips;
    return step.r;
  }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override {
    return {&contact_, touches_ ? std::size_t{1} : std::size_t{0}};
  }

  [[nodiscard]] const FlatSurface<N>& surface() const noexcept { return surface_; }
  [[nodiscard]] double friction() const noexcept { return mu_; }
  // Sets μ from the next step on. Precondition: `friction` is finite and not negative.
  void set_friction(double friction) noexcept { mu_ = friction; }

 private:
  FlatSurface<N> surface_;
  double mu_;
  Contact<N> contact_;
  bool touches_ = false;
};

}  // namespace proxarm::models
