// A point that is looked for on tangent planes: taken again at each new point until it stays.
#pragma once

#include <algorithm>
#include <limits>

#include "models/geometry.hpp"

namespace proxarm::models {

// Curved surfaces gain the factor penetration / radius with each new tangent plane, and more where they are slow.
inline constexpr int most_settling = 60;

// No closer than rounding lets it. Tiny moves (their squares, by which planes and curved surfaces differ, are nothing)
// are the last where the next one, shorter by `contraction`, would be nothing, or where they have stopped shrinking (a
// slip that is short against a deep p amplifies rounding, so a fixed threshold would not do).
inline bool has_settled(double move, bool shrinks, double contraction, const Vec3& r) noexcept {
  const double size = 1e-3 + r.lpNorm<1>(), nothing = 5e-17 * size;
  return move <= nothing || (move <= 1e-9 * size && (contraction * move <= nothing || !shrinks));
}

// r = solution(at); at = r is wanted.
class Settling {
 public:
  explicit Settling(const Vec3& from) noexcept : at_(from), last_at_(from), last_r_(from) {}

  // Where tangent planes are to be taken next.
  [[nodiscard]] const Vec3& at() const noexcept { return at_; }

  // What the solution on those at at() is; true: it has settled. Else at() has moved on.
  bool take(const Vec3& r) noexcept {
    const Vec3 f = r - at_;
    const double move = f.norm();
    // Of solution() itself: a move from a point that was looked ahead to may be shorter than the next one.
    // Nor does one along a bar, where nothing bends, tell of the next one across it: the greater of two.
    const double contraction = taken_ == 0 ? std::numeric_limits<double>::infinity()
                                           : (r - last_r_).norm() / std::max((at_ - last_at_).norm(), 1e-300);
    // Looking ahead makes some moves longer than the last one: rounding is where three aren't half the least so far.
    idle_ = move > 0.5 * least_move_ ? idle_ + 1 : 0;
    least_move_ = std::min(least_move_, move);
    if (has_settled(move, idle_ < 3, std::max(contraction, last_contraction_), r)) return true;
    last_contraction_ = contraction;
    // Where each step only takes a part of the error off, the steps of one and the next tell where they lead.
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
