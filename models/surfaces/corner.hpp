// Three flat surfaces at once: the proxy at the point where they meet.
//
// The point r is known. The question is whether the three contacts together can bear f = r − p (in units where K = 1):
//   f = Σ f_i (n_i − μ_i v_i/‖v_i‖),  f_i ≥ 0,  v_i = N_i N_iᵀ (r − q_i).
// A contact at rest (v_i = 0) bears any force of its friction cone. in_sum_of_cones (cone_sum.hpp) answers the
// question.
#pragma once

#include <array>

#include "models/surfaces/groove.hpp"

namespace proxarm::models {

struct CornerPoint {
  bool exists = false;  // false: within rounding, two normals are (anti)parallel or all three lie in a plane
  Vec3 x0 = Vec3::Zero();
  Mat3 dual = Mat3::Zero();  // f = Σ (row_iᵀ f) n_i

  CornerPoint() = default;
  CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept;

  // Moves x onto all three surfaces by one Newton step. Repeated steps leave heights no larger than the rounding of x.
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

// The proxy held by all three contacts at their common point. Not found if a contact would have to pull, or without a
// common point.
CornerSolution solve_corner(const std::array<PlaneContact, 3>& contacts, const CornerPoint& corner,
                            const Vec3& p) noexcept;

}  // namespace proxarm::models
