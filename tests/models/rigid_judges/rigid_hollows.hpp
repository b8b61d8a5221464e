// Hollow spheres, capsules, cylinders and boxes, tools that fit into them, and how far a tool is from what it is in by
// formulas that share nothing with RigidWorld.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "models/base/random.hpp"
#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"

namespace proxarm::models {

// -- the judge: all points within a radius of some points, and circles ------------------------------------------------

struct Circle {
  Vec3 centre = Vec3::Zero(), u = Vec3::UnitX(), v = Vec3::UnitY();
  double radius = 0.0;
};
struct Inside {
  std::vector<Vec3> points;
  double radius = 0.0;
  std::vector<Circle> circles;
};
using Real = long double;
using Depth = std::function<Real(const Eigen::Matrix<Real, 3, 1>&)>;  // of a point below a hollow's surface

// The least of a function on a circle, by places and thirds.
inline Real least_on(const Circle& circle, const ToolPose& pose, const Depth& depth) {
  constexpr int places = 48;
  constexpr Real step = 2.0L * 3.14159265358979323846264L / places;
  const Mat3 R = pose.orientation.toRotationMatrix();
  const Eigen::Matrix<Real, 3, 1> c = (pose.position + R * circle.centre).cast<Real>();
  const Eigen::Matrix<Real, 3, 1> u = circle.radius * (R * circle.u).cast<Real>();
  const Eigen::Matrix<Real, 3, 1> v = circle.radius * (R * circle.v).cast<Real>();
  const auto at = [&](Real angle) { return depth(c + std::cos(angle) * u + std::sin(angle) * v); };
  std::array<Real, places> value;
  for (int k = 0; k < places; ++k) value[static_cast<std::size_t>(k)] = at(step * static_cast<Real>(k));
  Real least = value[0];
  for (int k = 0; k < places; ++k) {
    const Real here = value[static_cast<std::size_t>(k)];
    if (here > value[static_cast<std::size_t>((k + 1) % places)]) continue;
    if (here > value[static_cast<std::size_t>((k + places - 1) % places)]) continue;
    Real low = step * static_cast<Real>(k - 1), high = step * static_cast<Real>(k + 1);
    for (int i = 0; i < 60; ++i) {
      const Real x = low + (high - low) / 3.0L, y = high - (high - low) / 3.0L;
      (at(x) > at(y) ? low : high) = at(x) > at(y) ? x : y;
    }
    least = std::min(least, at(0.5L * (low + high)));
  }
  return least;
}

inline double least_depth(const Inside& tool, const ToolPose& pose, const Depth& depth) {
  Real least = 1.0L;
  for (const Vec3& p : tool.points) {
    least = std::min(least, depth((pose * p).cast<Real>()) - static_cast<Real>(tool.radius));
  }
  for (const Circle& circle : tool.circles) least = std::min(least, least_on(circle, pose, depth));
  return static_cast<double>(least);
}

inline Depth in_segment(const Vec3& from, const Vec3& to, double radius) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) {
    const Eigen::Matrix<Real, 3, 1> a = from.cast<Real>(), d = (to - from).cast<Real>();
    const Real s = d.isZero(0.0L) ? 0.0L : std::clamp<Real>(d.dot(p - a) / d.squaredNorm(), 0.0L, 1.0L);
    return static_cast<Real>(radius) - (p - a - s * d).norm();
  };
}

inline Depth in_box(const Vec3& size) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) { return (0.5L * size.cast<Real>() - p.cwiseAbs()).minCoeff(); };
}

// Along z, about the origin.
inline Depth in_cylinder(double length, double radius) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) {
    return std::min(0.5L * static_cast<Real>(length) - std::abs(p.z()),
                    static_cast<Real>(radius) - std::hypot(p.x(), p.y()));
  };
}

// -- hollows and tools ------------------------------------------------------------------------------------------------

struct Hollow {
  std::vector<decltype(RigidObject::shape)> shapes;
  Depth depth;
};

inline Hollow hollow_sphere(double radius) {
  return {{HollowSphere{Vec3::Zero(), radius}}, in_segment(Vec3::Zero(), Vec3::Zero(), radius)};
}
inline Hollow hollow_capsule(double length, double radius) {
  const Vec3 half(0.0, 0.0, 0.5 * length);
  return {{HollowTube{-half, half, radius, false}}, in_segment(-half, half, radius)};
}
inline Hollow hollow_cylinder(double length, double radius) {
  const Vec3 half(0.0, 0.0, 0.5 * length);
  return {
      {HollowTube{-half, half, radius, true}, FlatSide{Vec3::UnitZ(), -half.z()}, FlatSide{-Vec3::UnitZ(), -half.z()}},
      in_cylinder(length, radius)};
}
inline Hollow hollow_box(const Vec3& size) {
  Hollow out{{}, in_box(size)};
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {-1.0, 1.0}) out.shapes.emplace_back(FlatSide{sign * Vec3::Unit(k), -0.5 * size[k]});
  }
  return out;
}

struct Shaped {
  Tool tool;
  Inside inside;
};

inline Shaped cylinder_tool(double length, double radius) {
  Shaped out{{{{CylinderTool{length, radius}, Pose::Identity(), {}}}}, {}};
  for (const double z : {-0.5 * length, 0.5 * length}) {
    out.inside.circles.push_back({{0.0, 0.0, z}, Vec3::UnitX(), Vec3::UnitY(), radius});
  }
  return out;
}

inline Shaped random_tool_inside(Random& random, int kind) {
  const double length = random.uniform(0.01, 0.03), radius = random.uniform(0.003, 0.01);
  if (kind == 0) return {{{{SphereTool{radius}, Pose::Identity(), {}}}}, {{Vec3::Zero()}, radius, {}}};
  if (kind == 1) {
    const Vec3 half(0.0, 0.0, 0.5 * length);
    return {{{{CapsuleTool{length, radius}, Pose::Identity(), {}}}}, {{-half, half}, radius, {}}};
  }
  if (kind == 2) {
    const Vec3 size(length, radius, 2.0 * radius);
    return {{{{BoxTool{size}, Pose::Identity(), {}}}}, {polyhedron_of_box(size, Pose::Identity()).corners, 0.0, {}}};
  }
  return cylinder_tool(length, radius);
}

}  // namespace proxarm::models
