// The directions in which a corner or an edge of a body may rest on a plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Tolerance in radians for a direction outside the cone between the normals beside an edge, or between the normals of a
// cylinder's end and side. It is needed for two reasons:
// 1. If a face lies on an edge, the direction lies on the border of the cone, and directions on either side of the
//    border must be accepted.
// 2. The normals of narrow faces are known only to this accuracy.
// The tolerance admits no false contact: at a place where two edges really meet, solids that are outside of each other
// obey the exact cone.
inline constexpr double askew_rad = 0.02;

// A cone that contains every direction in which a corner may rest on a plane:
// 1. A corner that rests on a plane is the point of its body that is furthest along the plane's normal.
// 2. This normal is then a sum of the normals of the faces that meet at the corner, each times a factor that isn't
//    negative. (Reason: a plane that is moved inwards cuts off a piece around the corner. The area vectors of the faces
//    of this piece add up to the area vector of the cut.)
// 3. So the normal lies within the cone around the faces' normals, if this cone contains less than half of all
//    directions.
// The reverse isn't true: the cone is wider than the set of these sums, so a corner can't rest in every direction of
// the cone.
struct NormalCone {
  // An angle, given by its cosine and sine: half the opening of a cone, or by how much the normals of a face's
  // neighbours differ from the face's normal, or by how much a body may turn in later poses. From 1 rad (some 60°) on,
  // the angle counts as `any`. So the sum of three angles that aren't `any` stays below half a turn.
  struct Angle {
    static constexpr double most = 1.0;  // rad
    double cosine = any, sine = 0.0;
    static Angle of(double angle) noexcept { return angle < most ? Angle{std::cos(angle), std::sin(angle)} : Angle{}; }
    // Returns the angle between two unit vectors; from 90° on it is `any`.
    static Angle between(const Vec3& a, const Vec3& b) noexcept {
      const double cosine = a.dot(b);
      return cosine > 0.0 ? Angle{cosine, a.cross(b).norm()} : Angle{};
    }
    [[nodiscard]] bool is_any() const noexcept { return cosine == any; }
    // Returns this angle, or `any` if it is 1 rad or more. Must be called on a sum of two angles before another angle
    // is added.
    [[nodiscard]] Angle narrow() const noexcept { return cosine > std::cos(most) ? *this : Angle{}; }
    friend Angle operator+(const Angle& a, const Angle& b) noexcept {
      if (a.is_any() || b.is_any()) return {};
      return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
    }

   private:
    static constexpr double any = 2.0;  // not the cosine of any angle
  };

  Vec3 axis = Vec3::Zero();
  Angle half{};

  [[nodiscard]] NormalCone seen_by(const Mat3& R) const noexcept { return {R * axis, half}; }
  // True if a unit direction lies in the cone, or would lie in it after a rotation by `turn`.
  [[nodiscard]] bool holds(const Vec3& direction, const Angle& turn) const noexcept {
    const Angle most = half + turn;
    return most.is_any() || axis.dot(direction) >= most.cosine;
  }
};

// The normal cones of a body's corners and edges, and an angle for each face. The angle says by how much the normals at
// the face's corners differ from the face's own normal. It is needed for a corner of another body that lies on an edge:
// this corner rests on both faces beside the edge, so neither face's normal alone need lie in the corner's cone.
struct NormalCones {
  std::vector<NormalCone> of_corners;
  std::vector<NormalCone::Angle> around_faces;
  std::vector<NormalCone> of_edges{};
};

// Returns the cone around the normals beside an edge, widened by askew_rad.
inline NormalCone cone_of_edge(const Vec3& left, const Vec3& right) noexcept {
  const Vec3 sum = left + right;
  if (!(sum.norm() > 0.0)) return {};
  const Vec3 axis = sum.normalized();
  return {axis, NormalCone::Angle::of(std::acos(std::clamp(axis.dot(left), -1.0, 1.0)) + askew_rad)};
}

// Computes the cones of the corners and the angles of the faces. `each_face` takes a function and calls it with the
// unit normal and the corners of every face.
template <typename EachFace>
NormalCones normal_cones(std::size_t corners, EachFace each_face) {
  NormalCones out;
  out.of_corners.resize(corners);
  each_face([&](const Vec3& normal, const auto& at) {
    for (const auto i : at) out.of_corners[i].axis += normal;
  });
  for (NormalCone& cone : out.of_corners) cone.axis.normalize();
  const auto between = [](const Vec3& a, const Vec3& b) { return std::acos(std::clamp(a.dot(b), -1.0, 1.0)); };
  std::vector<double> widest(corners, 0.0);
  each_face([&](const Vec3& normal, const auto& at) {
    for (const auto i : at) widest[i] = std::max(widest[i], between(out.of_corners[i].axis, normal));
  });
  each_face([&](const Vec3& normal, const auto& at) {
    double around = 0.0;
    for (const auto i : at) around = std::max(around, between(out.of_corners[i].axis, normal) + widest[i]);
    out.around_faces.push_back(NormalCone::Angle::of(around));
  });
  for (std::size_t i = 0; i < corners; ++i) {
    if (!out.of_corners[i].axis.isZero(0.0)) out.of_corners[i].half = NormalCone::Angle::of(widest[i]);
  }
  return out;
}

}  // namespace proxarm::models
