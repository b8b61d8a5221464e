// Solves the contact with two flat surfaces at once: the proxy is in the line where the surfaces meet, with friction on
// each surface.
//
// Both contacts hold the proxy at r = x₀ + s e. In units where K = 1 the contacts share the force f = r − p:
//   Σ f_i (n_i − μ_i v_i/‖v_i‖) = r − p,   f_i ≥ 0.
// The equation for s is derived as follows:
// 1. By (17), contact i slips along v_i = N_i N_iᵀ (r − q_i) = (s − s_i) e + w_i t_i, with
//      t_i = e × n_i,   s_i = eᵀ(q_i − x₀),   w_i = −t_iᵀ(q_i − x₀).
//    If the proxy arrives from beside the line, w_i ≠ 0. Without the term w_i t_i, the force would be wrong by up to
//    18 %.
// 2. For a given s, the components of the balance across e are a 2 × 2 linear system for f₁ and f₂.
// 3. The component along e, with s_p = eᵀ(p − x₀), is one scalar equation for s:
//      g(s) = s − s_p + Σ f_i μ_i (s − s_i)/‖v_i‖ = 0.
// The code solves it by the secant method and, if that method fails, by false position.
//
// If the proxy was already in the line (w_i = 0), the solution is in closed form. With the forces f_i without friction,
//   s = s_q if |s_p − s_q| ≤ μ₁f₁ + μ₂f₂,  else s_p ∓ (μ₁f₁ + μ₂f₂).
// In this solution a sticking contact exerts friction along e only. If the contacts squeezed each other, they could
// hold a larger force. But then the sliding solution exists too; it is nearer to p, so it is chosen.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

// A flat surface with friction.
struct Face {
  FlatSurface<3> surface;
  double mu = 0.0;
  std::int32_t object = -1;  // index that contacts report; −1: they report the face's index
  std::int32_t feature = 0;
};

// One of several contacts: a flat surface, or the tangent plane of a curved surface.
struct PlaneContact {
  const FlatSurface<3>& surface;
  double mu;
  // The last position of the proxy relative to the surface: a moving surface carries q along.
  const Vec3& q;
};

// The line in which two faces meet.
struct GrooveLine {
  bool exists = false;  // false: within rounding, the normals are parallel or opposite
  Vec3 e = Vec3::Zero();
  Vec3 x0 = Vec3::Zero();
  Vec3 t1 = Vec3::Zero(), t2 = Vec3::Zero();
  double cos = 1.0, sin = 0.0;  // cosine and sine of the angle between the normals

  GrooveLine() = default;
  GrooveLine(const FlatSurface<3>& a, const FlatSurface<3>& b) noexcept
      : GrooveLine(a, b, Vec3(0.5 * (a.point() + b.point()))) {
    if (exists) x0 = settle(a, b, settle(a, b, x0));
  }
  // Puts x₀ close to `near`. Precondition: `near` is so close to the line that one call of settle() puts x₀ onto the
  // line.
  GrooveLine(const FlatSurface<3>& a, const FlatSurface<3>& b, const Vec3& near) noexcept {
    const Vec3 &n1 = a.normal(), &n2 = b.normal();
    const Vec3 c = n1.cross(n2);
    cos = n1.dot(n2);
    sin = c.norm();
    // The cross product has a rounding error of 2e-16, so below 1e-14 e has less than two correct digits.
    exists = sin > 1e-14;
    if (!exists) return;
    e = c / sin;
    t1 = e.cross(n1);
    t2 = e.cross(n2);
    x0 = settle(a, b, near);
  }

  // Returns the point of the line nearest to x. After repeated calls, the heights of the point are no larger than the
  // rounding of x, at any angle. The rounding of the position along t₁ is 1/sin times as large.
  [[nodiscard]] Vec3 settle(const FlatSurface<3>& a, const FlatSurface<3>& b, const Vec3& x) const noexcept {
    const double h1 = a.height(x), h2 = b.height(x);
    return x - h1 * a.normal() + ((h1 * cos - h2) / sin) * t1;
  }
};

struct GrooveSolution {
  bool found = false;
  bool slips1 = false, slips2 = false;
  Vec3 r = Vec3::Zero();
};

enum class GrooveSearch {
  all_roots,   // if a contact pulls at the first root of g, the search tries other roots
  first_root,  // if a contact pulls at the first root of g, nothing is found
  may_pull,    // a contact may pull: for tangent planes of curved surfaces during their iteration
};

// Returns the position of the proxy if both contacts hold it in their line. `found` is false if a contact would have to
// pull, or if the surfaces have no common line.
GrooveSolution solve_groove(const PlaneContact& a, const PlaneContact& b, const GrooveLine& line, const Vec3& p,
                            GrooveSearch search = GrooveSearch::all_roots) noexcept;

}  // namespace proxarm::models
