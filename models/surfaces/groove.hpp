// Two flat surfaces at once: the proxy in the line where they meet, with friction on each side.
//
// Both contacts hold the proxy at r = x₀ + s e. In units where K = 1 they share the force f = r − p:
//   Σ f_i (n_i − μ_i v_i/‖v_i‖) = r − p,   f_i ≥ 0.
// By (17) for each surface, contact i slips along v_i = N_i N_iᵀ (r − q_i) = (s − s_i) e + w_i t_i, with
//   t_i = e × n_i,   s_i = eᵀ(q_i − x₀),   w_i = −t_iᵀ(q_i − x₀).
// On arrival from beside the line w_i ≠ 0; without this term the force would be wrong by up to 18 %. Given s, the
// components across e are a 2 × 2 linear system for f₁ and f₂. The component along e, with s_p = eᵀ(p − x₀), is one
// scalar equation,
//   g(s) = s − s_p + Σ f_i μ_i (s − s_i)/‖v_i‖ = 0,
// solved by the secant method and, if that fails, by false position.
//
// If the proxy was already in the line (w_i = 0), the solution is in closed form: f_i are the forces without friction,
// and
//   s = s_q if |s_p − s_q| ≤ μ₁f₁ + μ₂f₂,  else s_p ∓ (μ₁f₁ + μ₂f₂).
// Here a sticking contact bears friction along e only. Contacts that squeeze each other could hold more, but then the
// sliding solution exists too. It is nearer to p, so it is the one chosen.
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
  std::int32_t object = -1;  // reported in contacts; −1: the face's index
  std::int32_t feature = 0;
};

// A flat surface, or the tangent plane of a curved one, as one of several contacts.
struct PlaneContact {
  const FlatSurface<3>& surface;
  double mu;
  const Vec3& q;  // the previous proxy as the surface sees it, carried along with a moving surface
};

// The line in which two faces meet.
struct GrooveLine {
  bool exists = false;  // false: within rounding, the normals are parallel or opposite
  Vec3 e = Vec3::Zero();
  Vec3 x0 = Vec3::Zero();
  Vec3 t1 = Vec3::Zero(), t2 = Vec3::Zero();
  double cos = 1.0, sin = 0.0;  // of the angle between the normals

  GrooveLine() = default;
  GrooveLine(const FlatSurface<3>& a, const FlatSurface<3>& b) noexcept
      : GrooveLine(a, b, Vec3(0.5 * (a.point() + b.point()))) {
    if (exists) x0 = settle(a, b, settle(a, b, x0));
  }
  // Puts x₀ close to `near`. Precondition: `near` is so close to the line that one step settles x₀.
  GrooveLine(const FlatSurface<3>& a, const FlatSurface<3>& b, const Vec3& near) noexcept {
    const Vec3 &n1 = a.normal(), &n2 = b.normal();
    const Vec3 c = n1.cross(n2);
    cos = n1.dot(n2);
    sin = c.norm();
    exists = sin > 1e-14;  // the cross product's rounding is 2e-16: below 1e-14, e has less than two digits
    if (!exists) return;
    e = c / sin;
    t1 = e.cross(n1);
    t2 = e.cross(n2);
    x0 = settle(a, b, near);
  }

  // The point of the line nearest to x. Repeated, it leaves heights no larger than the rounding of x, at any angle; the
  // position along t₁ is then known to 1/sin of that rounding.
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
  all_roots,   // if a contact pulls at the first root of g, the search goes on
  first_root,  // not found if a contact pulls at the first root
  may_pull,    // found even if a contact pulls: for unsettled tangent planes of curved surfaces
};

// The proxy held by both contacts in their line. Not found if a contact would have to pull, or without a line.
GrooveSolution solve_groove(const PlaneContact& a, const PlaneContact& b, const GrooveLine& line, const Vec3& p,
                            GrooveSearch search = GrooveSearch::all_roots) noexcept;

}  // namespace proxarm::models
