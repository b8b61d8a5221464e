// Defines a flat surface through any point of space, and the rounding error of a point's height above the surface.
//
// The paper's surface contains the origin. Here heights are relative to `point`, so a surface a kilometre away loses no
// more accuracy than the rounding of its coordinates. The normal has length one within rounding and points to the free
// side.
#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Returns v scaled to length one, without under- or overflow. Throws std::invalid_argument if v is zero or not finite.
template <int N>
Vec<N> unit(const Vec<N>& v) {
  const double largest = v.cwiseAbs().maxCoeff();
  if (!v.allFinite() || !(largest > 0.0)) throw std::invalid_argument("a normal needs a finite, nonzero length");
  const Vec<N> scaled = v / largest;
  return scaled / scaled.norm();
}

template <int N>
class FlatSurface {
 public:
  // `point_m` is finite; `normal` has any finite length but zero. Throws std::invalid_argument for other values.
  FlatSurface(const Vec<N>& point_m, const Vec<N>& normal)
      : point_(point_m), normal_(unit<N>(normal)), point_size_(point_m.template lpNorm<1>()) {
    if (!point_m.allFinite()) throw std::invalid_argument("a surface needs a finite point");
  }

  // Returns a surface from a normal of length one, for tangent planes within a step. Precondition: both arguments are
  // finite, and the normal's length is one within rounding.
  static FlatSurface of_unit(const Vec<N>& point_m, const Vec<N>& unit_normal) noexcept {
    FlatSurface surface;
    surface.point_ = point_m;
    surface.normal_ = unit_normal;
    surface.point_size_ = point_m.template lpNorm<1>();
    return surface;
  }

  [[nodiscard]] const Vec<N>& point() const noexcept { return point_; }
  [[nodiscard]] const Vec<N>& normal() const noexcept { return normal_; }

  // Returns nᵀ(x − point) in metres, positive on the free side. This is the paper's nᵀx if `point` is the origin.
  [[nodiscard]] double height(const Vec<N>& x) const noexcept { return normal_.dot(x - point_); }

  // Returns the orthogonal projection of x onto the surface, x − n nᵀ(x − point).
  [[nodiscard]] Vec<N> projection(const Vec<N>& x) const noexcept { return x - normal_ * height(x); }

  // Returns a height (m) below which rounding makes a point indistinguishable from a point on the surface.
  //
  // Derivation, with u = 2⁻⁵³ and N ≤ 3, for a point x that is meant to be on the surface:
  // 1. The computed height has an error of u ‖x‖ from the coordinates, u ‖x − point‖ from the difference x − point, and
  //    (N + 1) u ‖x − point‖ from the sum: together at most 6 u (‖x‖₁ + ‖point‖₁).
  // 2. One more u (‖x‖₁ + ‖point‖₁) covers second-order terms and ‖n‖ = 1 + O(u).
  // 3. The function returns more than twice this sum: 16 u (‖x‖₁ + ‖point‖₁). Within a metre of the origin this is
  //    about 2e-15 m.
  [[nodiscard]] double rounding(const Vec<N>& x) const noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return 16.0 * u * (x.template lpNorm<1>() + point_size_);
  }

  // Returns ‖point‖₁, the size of the point's coordinates.
  [[nodiscard]] double size() const noexcept { return point_size_; }

  [[nodiscard]] bool holds(const Vec<N>& x) const noexcept { return std::abs(height(x)) <= rounding(x); }

 private:
  FlatSurface() = default;

  Vec<N> point_;
  Vec<N> normal_;
  double point_size_;
};

}  // namespace proxarm::models
