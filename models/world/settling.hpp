// Finds a fixed point r = solution(r), where solution(x) is the solution on the tangent planes at x, by Anderson
// acceleration of depth 1 (D. G. Anderson, "Iterative procedures for nonlinear integral equations", Journal of the ACM
// 12, 1965).
#pragma once

#include <algorithm>
#include <limits>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// With each new tangent plane the error shrinks by the factor penetration / radius, so that steps of micrometres need
// two or three. 60 are enough for a penetration of about half the radius; deeper tools often have no fixed point, and
// the set of contacts is then given up.
inline constexpr int most_settling = 60;

// Whether r has settled as far as rounding lets it. A move of less than 1e-9 of the coordinates bends no tangent plane
// any more, because planes and curved surfaces differ by its square. Such a move is the last one if the next, shorter
// by `contraction`, would be below rounding, or if moves have stopped shrinking. (A slip that is short against a deep p
// amplifies rounding, so a fixed threshold would not do.)
inline bool has_settled(double move, bool shrinks, double contraction, const Vec3& r) noexcept {
  const double size = 1e-3 + r.lpNorm<1>(), nothing = 5e-17 * size;
  return move <= nothing || (move <= 1e-9 * size && (contraction * move <= nothing || !shrinks));
}

// The iteration: the caller takes solution(at()) and passes it to take(), until that returns true.
class Settling {
 public:
  explicit Settling(const Vec3& from) noexcept : at_(from), last_at_(from), last_r_(from) {}

  // The point at which the tangent planes are to be taken next.
  [[nodiscard]] const Vec3& at() const noexcept { return at_; }

  // Takes r = solution(at()). Returns true if it has settled; at() has moved on otherwise.
  bool take(const Vec3& r) noexcept {
    const Vec3 f = r - at_;
    const double move = f.norm();
    // Contraction estimate of solution() itself: the larger of the last two. One alone can be too small: along a bar
    // nothing bends, and an accelerated step may land next to the fixed point by chance.
    const double contraction = taken_ == 0 ? std::numeric_limits<double>::infinity()
                                           : (r - last_r_).norm() / std::max((at_ - last_at_).norm(), 1e-300);
    // Acceleration makes some moves longer than the one before. Rounding is reached where three moves in a row aren't
    // below half the least so far.
    idle_ = move > 0.5 * least_move_ ? idle_ + 1 : 0;
    least_move_ = std::min(least_move_, move);
    if (has_settled(move, idle_ < 3, std::max(contraction, last_contraction_), r)) return true;
    last_contraction_ = contraction;
    // Anderson's mix of the last two: θ minimises ‖f − θ (f − f_last)‖, f = solution(at) − at. For an iteration that
    // contracts by one constant factor, this is the limit itself.
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
