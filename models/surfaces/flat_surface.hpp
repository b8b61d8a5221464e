// A flat surface through any point of space, and the rounding errors of its heights.
//
// The paper's surface contains the origin. Here heights are relative to `point`, so that a surface a kilometre away
// loses only what its coordinates can't hold. The normal has length one within rounding and points to the free side.
#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// v scaled to length one, without under- or overflow. Throws std::invalid_argument if v is zero or not finite.
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
  // point in metres; normal of any length but zero. Throws std::invalid_argument for other values.
  FlatSurface(const Vec<N>& point_m, const Vec<N>& normal)
      : point_(point_m), normal_(unit<N>(normal)), point_size_(point_m.template lpNorm<1>()) {
    if (!point_m.allFinite()) throw std::invalid_argument("a surface needs a finite point");
  }

  // A surface from a normal of length one, for tangent planes within a step. Precondition: both arguments are finite,
  // and the normal's length is one within rounding.
  static FlatSurface of_unit(const Vec<N>& point_m, const Vec<N>& unit_normal) noexcept {
    FlatSurface surface;
    surface.point_ = point_m;
    surface.normal_ = unit_normal;
    surface.point_size_ = point_m.template lpNorm<1>();
    return surface;
  }

  [[nodiscard]] const Vec<N>& point() const noexcept { return point_; }
  [[nodiscard]] const Vec<N>& normal() const noexcept { return normal_; }

  // nᵀ(x − point) in metres, positive on the free side: the paper's nᵀx if point is the origin.
  [[nodiscard]] double height(const Vec<N>& x) const noexcept { return normal_.dot(x - point_); }

  // The orthogonal projection onto the surface, x − n nᵀ(x − point).
  [[nodiscard]] Vec<N> projection(const Vec<N>& x) const noexcept { return x - normal_ * height(x); }

  // The height (m) below which rounding can't tell a point from one on the surface.
  //
  // With u = 2⁻⁵³, the computed height of a point meant to be on the surface has an error of at most u ‖x‖
  // (coordinates) + u ‖x − point‖ (difference) + (N + 1) u ‖x − point‖ (sum), for N ≤ 3 at most 6 u (‖x‖₁ + ‖point‖₁).
  // One more unit covers second-order terms and ‖n‖ = 1 + O(u). The function returns more than twice that, 16 u: about
  // 2e-15 m within a metre of the origin.
  [[nodiscard]] double rounding(const Vec<N>& x) const noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return 16.0 * u * (x.template lpNorm<1>() + point_size_);
  }

  // ‖point‖₁: the size of the point's coordinates.
  [[nodiscard]] double size() const noexcept { return point_size_; }

  [[nodiscard]] bool holds(const Vec<N>& x) const noexcept { return std::abs(height(x)) <= rounding(x); }

 private:
  FlatSurface() = default;

  Vec<N> point_;
  Vec<N> normal_;
  double point_size_;
};

}  // namespace proxarm::models
