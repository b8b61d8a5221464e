#include "models/rigid_gaps/near_sides.hpp"

#include <cmath>

#include "models/rigid_gaps/twist_motion.hpp"

namespace proxarm::models {
namespace {

// Bound of sine², for an angle of 100 µrad. At larger angles rounding hardly moves the place. The place then doesn't
// depend on the pose before, so that a session can be continued identically from any cycle.
constexpr double kAlongEachOther = 1e-8;

}  // namespace

Vec3 NearSides::way(const Twist& delta) const noexcept {
  const Vec2 slopes = along.transpose() * delta;
  return -D / sine2 * inverse.row(0).dot(slopes) * u;
}

std::optional<NearSides> near_sides(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                    const ToolPose& pose) noexcept {
  const std::optional<Cylinder>&own = bodies.part(pair).cylinder, &other = bodies.entry(pair).cylinder;
  const auto along = [](const EdgeLine& edge) { return Vec3((edge.to - edge.from).normalized()); };
  NearSides sides;
  sides.u = pose.orientation * (own ? own->axis : along(bodies.own_edge(pair)));
  sides.v = other ? other->axis : along(bodies.other_edge(pair));
  sides.v = bodies.direction_in_W(pair.entry, sides.v);
  sides.own_radius = own ? own->radius : bodies.part(pair).solid.radius;
  sides.D = touch.gap + sides.own_radius;
  if (other) sides.D += other->radius;
  if (const Solid* solid = bodies.entry(pair).solid()) sides.D += solid->radius;
  sides.sine2 = sides.u.cross(sides.v).squaredNorm();
  if (!(sides.sine2 > 1e-14 && sides.D > 0.0)) return {};
  const Vec3& n = touch.normal;
  sides.P = Mat3::Identity() - n * n.transpose();
  sides.G = motion_of_point(touch.point - pose.position + sides.own_radius * n);
  sides.along.col(0) = sides.G.transpose() * (sides.P * sides.u) / sides.D;
  sides.along.col(0).tail<3>() += sides.u.cross(n);
  sides.along.col(1) = -(sides.G.transpose() * (sides.P * sides.v)) / sides.D;
  sides.inverse << 1.0, sides.u.dot(sides.v), sides.u.dot(sides.v), 1.0;
  return sides;
}

// 1. If the axes are parallel to 10 µrad, the pose, which is rounded to 1e-16, determines the place only to a
//    micrometre. With 10 N, this error is a torque of 10 µN m that differs at each pose.
// 2. Within this uncertainty the place stays where the last solution has it.
// 3. The gap there differs from the smallest gap by rounding²/(2 D sine²), at most 1e-18 m.
void stay_along_side(const RigidBodies& bodies, const Pair& pair, const ToolPose& pose, const Vec3& last_W,
                     Touch& touch) noexcept {
  const std::optional<NearSides> sides = near_sides(bodies, pair, touch, pose);
  if (!sides || sides->sine2 > kAlongEachOther) return;
  const double way = sides->u.dot(last_W - touch.point);
  if (!(std::abs(way) * sides->sine2 <= bodies.rounding_m(pose))) return;
  const Vec3 on_axis = touch.point + sides->own_radius * touch.normal + way * sides->u;
  const Vec3 across = sides->u - sides->u.dot(sides->v) * sides->v;
  touch.normal = (sides->D * touch.normal + way * across).normalized();
  touch.point = on_axis - sides->own_radius * touch.normal;
}

}  // namespace proxarm::models
