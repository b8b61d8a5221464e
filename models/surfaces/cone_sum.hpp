// Can several contacts together bear a force? Tests membership in a sum of circular cones, without iteration.
//
// A sticking contact can bear any force of its friction cone. A slipping contact bears only the edge of its cone
// against the motion: a half-line, which is a cone with μ = 0. Together they can bear
//   C = C₁ + C₂ + …,   C_i = {f | ‖f − a_i a_iᵀf‖ ≤ μ_i a_iᵀf}.
//
// C is closed unless cones oppose each other. By the separating-hyperplane theorem, f ∈ C ⟺ yᵀf ≥ 0 for all y of the
// dual cone C* = ∩ C_i*. Each dual is circular about the same axis: C_i* = {y | a_iᵀy ≥ sin β_i ‖y‖}, tan β_i = μ_i. So
// on the unit sphere C* is an intersection of caps, and the minimum of yᵀf lies at −f/‖f‖, at the point of one cap
// farthest from f, or where two caps' edges meet. f ∈ C unless one of these points is in all caps and has yᵀf < 0.
#pragma once

#include <cmath>
#include <limits>
#include <span>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct ForceCone {
  Vec3 axis;        // unit
  double mu = 0.0;  // tan of the half-angle; 0: a half-line
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

// Whether f is within tolerance_N of C. Meant for a handful of cones: the time grows with the cube of their number.
// Precondition: axes of unit length, μ ≥ 0.
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
    // The cap's point farthest from f, where yᵀf = f_n sin β − ‖f_t‖ cos β. (y.dot(f) would have an error of u
    // ‖f‖²/‖f_t‖ for f nearly along the axis.)
    if (sin_beta * f_n - cos_beta * f_t_size < -tolerance_N) {
      Vec3 away = f_t_size > 0.0 ? Vec3(f_t / -f_t_size) : a.unitOrthogonal();
      away = (away - a * a.dot(away)).normalized();
      if (detail::in_all_caps(sin_beta * a + cos_beta * away, cones, i, none)) return false;
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double mu_j = cones[j].mu, sin_beta_j = mu_j / std::sqrt(1.0 + mu_j * mu_j);
      const Vec3& b = cones[j].axis;
      // y = α a + γ b ± ω c with aᵀy = sin β_i, bᵀy = sin β_j, ‖y‖ = 1, c along a × b.
      const Vec3 cross = a.cross(b);
      const double sin2 = cross.squaredNorm(), cos = a.dot(b);
      if (!(sin2 > 1e-30)) continue;  // equal axes (one cap contains the other) or opposite axes (no edges meet)
      const double alpha = (sin_beta - cos * sin_beta_j) / sin2, gamma = (sin_beta_j - cos * sin_beta) / sin2;
      const double rest = 1.0 - alpha * sin_beta - gamma * sin_beta_j;
      if (rest < 0.0) continue;  // the caps' edges don't meet
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
