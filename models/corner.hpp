// Three flat surfaces at once: the proxy held in the point where they meet.
//
// The point is known; what is asked is whether the three can bear f = r − p together (in units where K = 1):
//   f = Σ f_i (n_i − μ_i v_i/‖v_i‖),  f_i ≥ 0,  v_i = N_i N_iᵀ (r − q_i),
// a contact at rest bearing anything in its friction cone.
#pragma once

#include "models/groove.hpp"

namespace proxarm::models {

struct CornerPoint {
  bool exists = false;  // false: two normals are (anti)parallel, or all three lie in a plane, within rounding
  Vec3 x0 = Vec3::Zero();
  Mat3 dual = Mat3::Zero();  // f = Σ (row_iᵀ f) n_i

  CornerPoint() = default;
  CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept;

  // x moved onto all three; repeated, it leaves heights of the size of x's own rounding.
  [[nodiscard]] Vec3 settle(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c,
                            const Vec3& x) const noexcept {
    return x - dual.transpose() * Vec3(a.height(x), b.height(x), c.height(x));
  }
};

struct CornerSolution {
  bool found = false;
  bool slips[3] = {false, false, false};
  Vec3 r = Vec3::Zero();
};

// The proxy held by all three; not found if they would have to pull. q[i] is the previous proxy as surface i sees it.
CornerSolution solve_corner(const FlatSurface<3>* const surface[3], const double mu[3], const CornerPoint& corner,
                            const Vec3& p, const Vec3* const q[3]) noexcept;

}  // namespace proxarm::models
