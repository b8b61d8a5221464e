// Tests, without iteration, whether several contacts together can exert a given force: whether the force is in a sum of
// circular cones.
//
// A sticking contact can exert any force of its friction cone. A slipping contact can exert only forces along one
// half-line: the line of its friction cone that opposes the motion. This half-line is a cone with μ = 0. Together the
// contacts can exert
//   C = C₁ + C₂ + …,   C_i = {f | ‖f − a_i a_iᵀf‖ ≤ μ_i a_iᵀf}.
//
// The test follows from four steps:
// 1. C is closed, unless cones oppose each other.
// 2. By the separating-hyperplane theorem, f ∈ C if and only if yᵀf ≥ 0 for all y of the dual cone C* = ∩ C_i*.
// 3. Each dual C_i* is a circular cone about the axis a_i: C_i* = {y | a_iᵀy ≥ sin β_i ‖y‖}, tan β_i = μ_i. On the unit
//    sphere C_i* is a cap, so C* is an intersection of caps.
// 4. The minimum of yᵀf over this intersection lies at −f/‖f‖, at the point of one cap farthest from f, or at a point
//    where the edges of two caps meet.
// Conclusion: f ∈ C unless one of these points is in all caps and has yᵀf < 0.
#pragma once

#include <cmath>
#include <limits>
#include <span>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct ForceCone {
  Vec3 axis;        // unit
  double mu = 0.0;  // tangent of the half-angle; 0: a half-line
};

namespace detail {

inline bool in_all_caps(const Vec3& y, std::span<const ForceCone> cones, std::size_t skip_a, std::size_t skip_b) {
  constexpr double rounding = 1e-14;  // y and the axes are unit vectors within a few units in the last place
  for (std::size_t i = 0; i < cones.size(); ++i) {
    if (i == skip_a || i == skip_b) continue;
    const double sin_beta = cones[i].mu / std::sqrt(1.0 + cones[i].mu * cones[i].mu);
    if (cones[i].axis.dot(y) < sin_beta - rounding) return false;
  }
  return true;
}

}  // namespace detail

// Whether f is within tolerance_N of C. Use it for a few cones only, because the time grows with the cube of the number
// of cones. Precondition: the axes have unit length, and μ ≥ 0.
inline bool in_sum_of_cones(const Vec3& f, std::span<const ForceCone> cones, double tolerance_N) noexcept {
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  const double size = f.norm();
  if (size <= tolerance_N) return true;
  if (cones.empty()) return false;
  if (detail::in_all_caps(-f / size, cones, none, none)) return false;
  for (std::size_t i = 0; i < cones.size(); ++i) {
    const double mu = cones[i].mu, cos_beta = 1.0 / std::sqrt(1.0 + mu * mu), sin_beta = mu * cos_beta;
    const Vec3& a = cones[i].axis;
    const double f_n = a.dot(f);
    const Vec3 f_t = f - a * f_n;
    const double f_t_size = f_t.norm();
    // Tests the point y of the cap that is farthest from f. There yᵀf = f_n sin β − ‖f_t‖ cos β. (If f is nearly along
    // the axis, y.dot(f) has an error of u ‖f‖²/‖f_t‖.)
    if (sin_beta * f_n - cos_beta * f_t_size < -tolerance_N) {
      Vec3 away = f_t_size > 0.0 ? Vec3(f_t / -f_t_size) : a.unitOrthogonal();
      away = (away - a * a.dot(away)).normalized();
      if (detail::in_all_caps(sin_beta * a + cos_beta * away, cones, i, none)) return false;
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double mu_j = cones[j].mu, sin_beta_j = mu_j / std::sqrt(1.0 + mu_j * mu_j);
      const Vec3& b = cones[j].axis;
      // The edges of the caps of a and b meet at y = α a + γ b ± ω c, with aᵀy = sin β_i, bᵀy = sin β_j, ‖y‖ = 1, and c
      // along a × b.
      const Vec3 cross = a.cross(b);
      const double sin2 = cross.squaredNorm(), cos = a.dot(b);
      if (!(sin2 > 1e-30)) continue;  // equal axes (one cap contains the other) or opposite axes (the edges don't meet)
      const double alpha = (sin_beta - cos * sin_beta_j) / sin2, gamma = (sin_beta_j - cos * sin_beta) / sin2;
      const double rest = 1.0 - alpha * sin_beta - gamma * sin_beta_j;
      if (rest < 0.0) continue;  // the edges of the caps don't meet
      const Vec3 mid = alpha * a + gamma * b, side = std::sqrt(rest / sin2) * cross;
      for (const double sign : {1.0, -1.0}) {
        const Vec3 vertex = mid + sign * side;
        if (vertex.dot(f) < -tolerance_N && detail::in_all_caps(vertex, cones, i, j)) return false;
      }
    }
  }
  return true;
}

}  // namespace proxarm::models
