// Solves the contact with three flat surfaces at once: the proxy is at the point where the surfaces meet.
//
// The point r is known. The question is whether the three contacts together can exert f = r − p (in units where K = 1):
//   f = Σ f_i (n_i − μ_i v_i/‖v_i‖),  f_i ≥ 0,  v_i = N_i N_iᵀ (r − q_i).
// A contact at rest (v_i = 0) can exert any force of its friction cone. in_sum_of_cones (cone_sum.hpp) answers the
// question.
#pragma once

#include <array>

#include "models/surfaces/groove.hpp"

namespace proxarm::models {

struct CornerPoint {
  // false if, within rounding, two normals are parallel or opposite, or all three normals lie in a plane
  bool exists = false;
  Vec3 x0 = Vec3::Zero();
  Mat3 dual = Mat3::Zero();  // any force is f = Σ (row_iᵀ f) n_i

  CornerPoint() = default;
  CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept;

  // Moves x onto all three surfaces by one Newton step. After repeated steps, the heights of x are no larger than the
  // rounding of x.
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

// Returns the position of the proxy if all three contacts hold it at their common point. `found` is false if a contact
// would have to pull, or if the surfaces have no common point.
CornerSolution solve_corner(const std::array<PlaneContact, 3>& contacts, const CornerPoint& corner,
                            const Vec3& p) noexcept;

}  // namespace proxarm::models
