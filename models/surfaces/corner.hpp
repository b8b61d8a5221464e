// Three flat surfaces at once: the proxy held in the point where they meet.
//
// The point r is known. The question is whether the three contacts together can bear f = r − p (in units where K = 1):
//   f = Σ f_i (n_i − μ_i v_i/‖v_i‖),  f_i ≥ 0,  v_i = N_i N_iᵀ (r − q_i),
// where a contact at rest (v_i = 0) bears any force of its friction cone. The answer is in_sum_of_cones (cone_sum.hpp).
#pragma once

#include <array>

#include "models/surfaces/groove.hpp"

namespace proxarm::models {

struct CornerPoint {
  bool exists = false;  // false: two normals are (anti)parallel, or all three lie in a plane, within rounding
  Vec3 x0 = Vec3::Zero();
  Mat3 dual = Mat3::Zero();  // f = Σ (row_iᵀ f) n_i

  CornerPoint() = default;
  CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept;

  // x moved onto all three surfaces by one Newton step. Repeated, it leaves heights of the size of x's own rounding.
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

// The proxy held by all three contacts in their common point; not found if one of them would have to pull, or if they
// have no common point.
CornerSolution solve_corner(const std::array<PlaneContact, 3>& contacts, const CornerPoint& corner,
                            const Vec3& p) noexcept;

}  // namespace proxarm::models
