// Bodies at random, and how far they are apart by formulas that share nothing with RigidWorld: all points within a
// radius of a box, of a segment (a box without width) or of a point.
#pragma once

#include "models/base/random.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/solid.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"

namespace proxarm::models {

inline Pose random_pose(Random& random, double half) {
  Pose X = Pose::Identity();
  const double angle = random.uniform(-3.0, 3.0);
  X.linear() = Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
  X.translation() = random.in_box(half);
  return X;
}

// Of a mass and a moment of inertia at 1 kHz.
inline Mat6 random_stiffness(Random& random) {
  const double M = random.log_uniform(0.5, 20.0), J = M * random.log_uniform(1e-4, 1e-2);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(1e6 * M), Vec3::Constant(1e6 * J);
  return K;
}

inline Vec3 random_size(Random& random, double least, double most) {
  Vec3 size;
  for (double& x : size) x = random.uniform(least, most);
  return size;
}

struct Body {
  Pose X = Pose::Identity();
  Vec3 size = Vec3::Zero();  // of the core
  double radius = 0.0;
};

inline Body at(const Body& body, const Pose& X) { return {X * body.X, body.size, body.radius}; }

inline double to_core(const Body& body, const Vec3& x) {
  const Vec3 d = (body.X.inverse() * x).cwiseAbs() - 0.5 * body.size;
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff());
}

// Between a core along z and another one: a convex function along the segment, of which thirds find the least.
inline double from_segment(const Body& along, const Body& other) {
  const Vec3 half = 0.5 * along.size.z() * along.X.linear().col(2), a = along.X.translation() - half;
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 80; ++k) {
    const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
    if (to_core(other, a + 2.0 * x * half) < to_core(other, a + 2.0 * y * half)) {
      high = y;
    } else {
      low = x;
    }
  }
  return std::min({to_core(other, a + 2.0 * low * half), to_core(other, a), to_core(other, a + 2.0 * half)});
}

inline double apart(const Body& a, const Body& b) {
  if (a.radius > 0.0) return from_segment(a, b) - a.radius - b.radius;
  if (b.radius > 0.0) return from_segment(b, a) - b.radius;
  return separation(polyhedron_of_box(a.size, a.X), polyhedron_of_box(b.size, b.X));
}

inline decltype(ToolPart::shape) shape_of(const Body& body) {
  if (!(body.radius > 0.0)) return BoxTool{body.size};
  if (body.size.z() > 0.0) return CapsuleTool{body.size.z(), body.radius};
  return SphereTool{body.radius};
}

inline Solid solid_of_body(const Body& body) {
  if (!(body.radius > 0.0)) return solid_of(BoxTool{body.size}, body.X);
  if (body.size.z() > 0.0) return solid_of(CapsuleTool{body.size.z(), body.radius}, body.X);
  return solid_of(SphereTool{body.radius}, body.X);
}

inline RigidObject object_of(const Body& body, double friction, std::int32_t number = 0) {
  RigidObject object;
  object.shape = solid_of_body(body);
  object.friction = friction;
  object.object = number;
  return object;
}

inline Body random_body(Random& random, double least, double most) {
  Body body;
  const int kind = random.below(3);
  if (kind == 0) body.size = random_size(random, least, most);
  if (kind == 1) body.size.z() = random.uniform(least, most);
  if (kind > 0) body.radius = random.uniform(0.2 * least, 0.5 * most);
  return body;
}

}  // namespace proxarm::models
