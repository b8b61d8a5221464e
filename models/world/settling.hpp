// Fixed-point iteration for contacts with curved surfaces: finds r = solution(r), where solution(x) solves the contacts
// on the tangent planes at x. Uses Anderson acceleration of depth 1 (D. G. Anderson, "Iterative procedures for
// nonlinear integral equations", Journal of the ACM 12, 1965).
#pragma once

#include <algorithm>
#include <limits>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Each new tangent plane shrinks the error by penetration / radius, so steps of micrometres need two or three. 60
// suffice for penetrations up to about half the radius; deeper tools often have no fixed point, and the set of contacts
// is given up.
inline constexpr int most_settling = 60;

// Whether r has settled as far as rounding allows. A move of less than 1e-9 of the coordinates no longer tilts tangent
// planes: a curved surface departs from its tangent plane only by the square of the move. It is the last move if the
// next one, shorter by `contraction`, would be below rounding, or if moves no longer shrink. (A fixed threshold would
// fail: a slip that is short compared with a deep p amplifies rounding.)
inline bool has_settled(double move, bool shrinks, double contraction, const Vec3& r) noexcept {
  const double size = 1e-3 + r.lpNorm<1>(), nothing = 5e-17 * size;
  return move <= nothing || (move <= 1e-9 * size && (contraction * move <= nothing || !shrinks));
}

// The iteration. The caller passes solution(at()) to take() until that returns true.
class Settling {
 public:
  explicit Settling(const Vec3& from) noexcept : at_(from), last_at_(from), last_r_(from) {}

  // The point for the next tangent planes.
  [[nodiscard]] const Vec3& at() const noexcept { return at_; }

  // Takes r = solution(at()). Returns true if r has settled; otherwise at() moves on.
  bool take(const Vec3& r) noexcept {
    const Vec3 f = r - at_;
    const double move = f.norm();
    // Estimates the contraction of solution() as the larger of the last two. A single one can be too small: along a bar
    // nothing curves, and an accelerated step may land next to the fixed point by chance.
    const double contraction = taken_ == 0 ? std::numeric_limits<double>::infinity()
                                           : (r - last_r_).norm() / std::max((at_ - last_at_).norm(), 1e-300);
    // Acceleration makes some moves longer than the last. Rounding is reached after three moves in a row above half of
    // the least so far.
    idle_ = move > 0.5 * least_move_ ? idle_ + 1 : 0;
    least_move_ = std::min(least_move_, move);
    if (has_settled(move, idle_ < 3, std::max(contraction, last_contraction_), r)) return true;
    last_contraction_ = contraction;
    // Anderson's mix of the last two iterates: θ minimises ‖f − θ (f − f_last)‖, f = solution(at) − at. For an
    // iteration with one constant contraction factor, this is the limit itself.
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
