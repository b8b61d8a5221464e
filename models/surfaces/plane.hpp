// Renders a flat wall without friction, equation (2).
//
//   𝒢(K, p, q) = p              if nᵀp > 0
//                p − n nᵀp      if nᵀp ≤ 0                        (2)
//
// p and q are relative to a point of the surface. ℳ is (14). The result is either on the surface within rounding
// (FlatSurface::rounding), or p itself, bit for bit.
#pragma once

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

template <int N>
class Plane final : public GeometricAlgorithm<N> {
 public:
  // Throws std::invalid_argument if the normal has no direction.
  Plane(const Vec<N>& point_m, const Vec<N>& normal) : surface_(point_m, normal) {
    contact_.normal = surface_.normal();
  }

  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& /*q*/) noexcept override {
    touches_ = !(surface_.height(p) > 0.0);
    if (!touches_) return p;  // (2), first case
    if constexpr (N == 1) return surface_.point();
    // This is (2), second case. One projection would leave an error of u ‖p‖, which matters for tiny κ and a p far
    // away; the second projection removes this error.
    return surface_.projection(surface_.projection(p));
  }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override {
    return {&contact_, touches_ ? std::size_t{1} : std::size_t{0}};
  }

  [[nodiscard]] const FlatSurface<N>& surface() const noexcept { return surface_; }

 private:
  FlatSurface<N> surface_;
  Contact<N> contact_;
  bool touches_ = false;
};

}  // namespace proxarm::models
