#include "models/geometry/tool_pose.hpp"

#include <algorithm>

namespace proxarm::models {

Quaternion rotation_from_z(const Vec3& direction) noexcept {
  // A turn counts as nearly a half turn if c + 1 is less than this; 1 + c has then lost more than half of its digits.
  constexpr double nearly = 1e-12;
  const Vec3 from = Vec3::UnitZ(), to = direction.normalized();
  const double c = to.dot(from);
  const Vec3 axis = from.cross(to);
  Quaternion turn;
  if (c < nearly - 1.0) {
    const double w2 = 0.5 * (1.0 + std::max(c, -1.0)), length = axis.norm();
    turn.w() = std::sqrt(w2);
    turn.vec() = std::sqrt(1.0 - w2) * (length > 0.0 ? Vec3(axis / length) : Vec3(-Vec3::UnitX()));
    return turn;
  }
  const double s = std::sqrt((1.0 + c) * 2.0), inverse = 1.0 / s;
  turn.vec() = axis * inverse;
  turn.w() = 0.5 * s;
  return turn;
}

}  // namespace proxarm::models
