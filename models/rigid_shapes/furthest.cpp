#include "models/rigid_shapes/furthest.hpp"

#include <cmath>

#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {

Vec3 furthest_of(const Tool& tool, const Vec3& direction) {
  Vec3 furthest = Vec3::Zero();
  double most = -HUGE_VAL;
  const auto take = [&](const Vec3& x) {
    if (direction.dot(x) > most) {
      most = direction.dot(x);
      furthest = x;
    }
  };
  const auto take_part = [&](const auto& shape, const Pose& X) {
    // No hull is needed: the furthest point of a hull is one of its points.
    if constexpr (requires { shape.points_m; }) {
      for (const Vec3& p : shape.points_m) take(X * p);
    } else {
      const Solid solid = solid_of(shape, X);
      for (const Vec3& p : solid.points) take(p + solid.radius * direction);
      for (const Solid::Rim& rim : solid.rims) {
        const Vec3 out = rim.u * rim.u.dot(direction) + rim.v * rim.v.dot(direction);
        take(rim.centre + rim.radius * out.stableNormalized());
      }
    }
  };
  for (const ToolPart& part : tool.parts)
    std::visit([&](const auto& shape) { take_part(shape, part.X_TP); }, part.shape);
  return furthest;
}

}  // namespace proxarm::models
