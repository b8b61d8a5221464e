#include "models/rigid_gaps/bends.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "models/rigid_gaps/near_sides.hpp"
#include "models/rigid_gaps/twist_motion.hpp"

namespace proxarm::models {
namespace {

// Bound of sine² of the angle between two edges. If edges cross at more than 13°, their place of contact moves along
// the edges by at most four times the motion across them. The iteration then finds the place without the gap's
// curvature.
constexpr double kCrossing = 0.05;

// The curvature of a hollow surface at a point, 1/m, in the directions of the projection P. A plane has the curvature
// 0.
struct Round {
  Mat3 P = Mat3::Zero();
  double curvature = 0.0;
};

Round round_at(const FlatSide& /*side*/, const Vec3& /*x*/) noexcept { return {}; }

Round round_at(const HollowSphere& hollow, const Vec3& x) noexcept {
  return {Mat3::Identity(), 1.0 / (x - hollow.centre).norm()};
}

Round round_at(const HollowTube& hollow, const Vec3& x) noexcept {
  const Vec3 along = hollow.to - hollow.from;
  const double s = along.dot(x - hollow.from) / along.squaredNorm();
  if (!hollow.endless && (s < 0.0 || s > 1.0)) {
    return {Mat3::Identity(), 1.0 / (x - (s < 0.0 ? hollow.from : hollow.to)).norm()};
  }
  const Vec3 a = along.normalized();
  return {Mat3::Identity() - a * a.transpose(), 1.0 / (x - hollow.from - s * along).norm()};
}

// Adds the bend of a point or a rim in a hollow object, or of a rim over a plane.
bool add_bend_in_field(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose,
                       double force, Mat6& K) noexcept {
  const bool is_rim = pair.kind == PairKind::rim_field;
  const Solid& own = bodies.part(pair).solid;
  const Vec3 m = -found.touch.normal, x = found.touch.point - own.radius * m;
  Round round;
  bool is_tube = false;
  const Placement* on = bodies.placement(pair.entry);
  with_flat_or_hollow(bodies.entry(pair).object, [&](const auto& shape) {
    round = round_at(shape, on == nullptr ? x : on->back(x));
    is_tube = std::is_same_v<std::decay_t<decltype(shape)>, HollowTube>;
  });
  if (!std::isfinite(round.curvature)) return false;
  if (on != nullptr) round.P = on->R * round.P * on->R.transpose();
  const Mat3 across = round.curvature * (round.P - m * m.transpose());
  const Eigen::Matrix<double, 3, 6> G = motion_of_point(x - pose.position);
  Mat6 bend = Mat6::Zero();
  if (round.curvature > 0.0) bend = G.transpose() * across * G;
  // If a rim is nearly level, only its first place is a lowest place. The other places are fixed points of the rim.
  if (is_rim && (is_tube || found.which == 0)) {
    const Solid::Rim& rim = own.rims[pair.own];
    const Vec3 arm = x - pose * rim.centre, along = (pose.orientation * rim.u.cross(rim.v)).cross(arm);
    const double h_aa = round.curvature > 0.0 ? along.dot(across * along) - m.dot(arm) : -m.dot(arm);
    if (h_aa < -kLevel_m) {
      Twist h_qa = Twist::Zero();
      if (round.curvature > 0.0) h_qa = G.transpose() * (across * along);
      h_qa.tail<3>() += along.cross(m);
      bend -= h_qa * (h_qa / h_aa).transpose();
    }
  }
  if (!(round.curvature > 0.0) && bend.isZero(0.0)) return false;
  K += force * bend;
  return true;
}

// Adds the bend of a rim over a face. The rim belongs to the tool or to the object. The face is flat; the gap bends
// because the lowest place moves around the rim.
bool add_bend_of_rim(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose,
                     double force, Mat6& K) noexcept {
  if (found.which != 0) return false;
  const std::optional<Cylinder>& own = bodies.part(pair).cylinder;
  const bool ours = own && pair.kind != PairKind::end_rim;
  Vec3 centre, axis;
  if (ours) {
    centre = pose * own->rims[pair.own].centre;
    axis = pose.orientation * own->axis;
  } else {
    const Cylinder& other = *bodies.entry(pair).cylinder;
    centre = other.rims[pair.other].centre;
    axis = other.axis;
    if (const Placement* on = bodies.placement(pair.entry)) {
      centre = *on * centre;
      axis = on->R * axis;
    }
  }
  // If the rim belongs to the object, the touch's point lies on the tool's face, and the rim's point is one gap away
  // from it.
  const Vec3 &n = found.touch.normal, x = ours ? found.touch.point : Vec3(found.touch.point - found.touch.gap * n);
  const Vec3 arm = x - centre, along = axis.cross(arm);
  const double h_aa = -std::abs(n.dot(arm));
  if (!(h_aa < -kLevel_m)) return false;
  Twist h_qa = Twist::Zero();
  h_qa.tail<3>() = along.cross(n);
  K -= force * h_qa * (h_qa / h_aa).transpose();
  return true;
}

bool add_bend_of_sides(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose,
                       double force, Mat6& K) noexcept {
  const std::optional<NearSides> sides = near_sides(bodies, pair, found.touch, pose);
  if (!sides || (pair.kind == PairKind::round_edges && sides->sine2 > kCrossing)) return false;
  const auto& along = sides->along;
  K += force * (sides->D / sides->sine2 * along * sides->inverse * along.transpose() -
                sides->G.transpose() * sides->P * sides->G / sides->D);
  return true;
}

}  // namespace

bool add_bend(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose, double force,
              Mat6& K) noexcept {
  if (is_along_side(pair.kind)) return add_bend_of_sides(bodies, pair, found, pose, force, K);
  if (is_in_field(pair.kind)) return add_bend_in_field(bodies, pair, found, pose, force, K);
  return is_flat_rim(pair.kind) && add_bend_of_rim(bodies, pair, found, pose, force, K);
}

double curvature_per_m(const RigidBodies& bodies, const Pair& pair) noexcept {
  const Solid& own = bodies.part(pair).solid;
  const Solid* other = bodies.entry(pair).solid();
  double bend = own.radius > 0.0 ? 1.0 / own.radius : 0.0;
  if (other != nullptr && other->radius > 0.0) bend += 1.0 / other->radius;
  if (is_of_cylinder(pair.kind)) {
    for (const auto* cylinder : {&bodies.part(pair).cylinder, &bodies.entry(pair).cylinder}) {
      if (*cylinder) bend += 1.0 / (*cylinder)->radius;
    }
  }
  return bend;
}

double sine_of_rims(const RigidBodies& bodies, const Pair& pair, const Touch& touch, const ToolPose& pose) noexcept {
  if (pair.kind != PairKind::rims && pair.kind != PairKind::rim_edge) return 1.0;
  const Vec3& n = touch.normal;
  const std::optional<Cylinder>&own = bodies.part(pair).cylinder, &other = bodies.entry(pair).cylinder;
  const auto along = [](const EdgeLine& edge) { return Vec3(edge.to - edge.from); };
  const auto in_W = [&](const Vec3& of_object) { return bodies.direction_in_W(pair.entry, of_object); };
  const Vec3 along_own =
      own ? Vec3((pose.orientation * own->axis).cross(n)) : Vec3(pose.orientation * along(bodies.own_edge(pair)));
  const Vec3 along_other = other ? Vec3(in_W(other->axis).cross(n)) : in_W(along(bodies.other_edge(pair)));
  const double lengths = along_own.norm() * along_other.norm();
  return lengths > kAlong ? std::max(along_own.cross(along_other).norm() / lengths, kAlong) : kAlong;
}

}  // namespace proxarm::models
