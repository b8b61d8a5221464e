// Solves contacts with curved surfaces by fixed-point iteration: finds r = solution(r), where solution(x) solves the
// contacts on the tangent planes at x. The iteration uses Anderson acceleration of depth 1 (D. G. Anderson, "Iterative
// procedures for nonlinear integral equations", Journal of the ACM 12, 1965).
#pragma once

#include <algorithm>
#include <limits>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Limit of the iterations. Each new tangent plane multiplies the error by about penetration / radius, so steps of
// micrometres need two or three iterations. 60 iterations suffice for penetrations of up to about half the radius. At
// greater penetrations often no fixed point exists, and the set of contacts is given up.
inline constexpr int most_settling = 60;

// Whether r has settled, as far as rounding allows. r has settled if one of these is true for the length of its last
// move:
// 1. The move is within rounding.
// 2. The move is less than 1e-9 of the coordinates, and either the next move, shorter by `contraction`, would be within
//    rounding, or the moves no longer shrink.
//
// Below 1e-9 of the coordinates, a move no longer tilts the tangent planes: a curved surface departs from its tangent
// plane only by the square of the move. A fixed threshold instead of condition 2 would fail, because a slip that is
// short compared with the depth of p amplifies rounding.
inline bool has_settled(double move, bool shrinks, double contraction, const Vec3& r) noexcept {
  const double size = 1e-3 + r.lpNorm<1>(), nothing = 5e-17 * size;
  return move <= nothing || (move <= 1e-9 * size && (contraction * move <= nothing || !shrinks));
}

// The fixed-point iteration. The caller passes solution(at()) to take() until take() returns true.
class Settling {
 public:
  explicit Settling(const Vec3& from) noexcept : at_(from), last_at_(from), last_r_(from) {}

  // Returns the point at which the caller takes the next tangent planes.
  [[nodiscard]] const Vec3& at() const noexcept { return at_; }

  // Takes r = solution(at()). Returns true if r has settled; otherwise moves at().
  bool take(const Vec3& r) noexcept {
    const Vec3 f = r - at_;
    const double move = f.norm();
    // Estimates the contraction of solution() as the larger of the last two estimates. A single estimate can be too
    // small: along a bar the surface isn't curved, and an accelerated step may end next to the fixed point by chance.
    const double contraction = taken_ == 0 ? std::numeric_limits<double>::infinity()
                                           : (r - last_r_).norm() / std::max((at_ - last_at_).norm(), 1e-300);
    // Because of the acceleration, some moves are longer than the move before. The moves count as no longer shrinking
    // after three moves in a row that are above half of the shortest move so far.
    idle_ = move > 0.5 * least_move_ ? idle_ + 1 : 0;
    least_move_ = std::min(least_move_, move);
    if (has_settled(move, idle_ < 3, std::max(contraction, last_contraction_), r)) return true;
    last_contraction_ = contraction;
    // Mixes the last two iterates by Anderson's method: θ minimises ‖f − θ (f − f_last)‖, where f = solution(at) − at.
    // If the contraction factor of the iteration is constant, the mix is the fixed point itself.
    const Vec3 bend = f - last_f_;
    const double theta = taken_ < 2 ? 0.0 : f.dot(bend) / std::max(bend.squaredNorm(), 1e-300);
    const Vec3 ahead = r - theta * (r - last_r_);
    ++taken_;
    last_at_ = at_;
    last_r_ = r;
    last_f_ = f;
    at_ = (ahead - r).norm() <= 10.0 * move ? ahead : r;
    return false;
  }

 private:
  Vec3 at_, last_at_, last_r_, last_f_ = Vec3::Zero();
  double least_move_ = std::numeric_limits<double>::infinity(), last_contraction_ = least_move_;
  int taken_ = 0, idle_ = 0;
};

}  // namespace proxarm::models
