// In which directions a corner of a body may rest on a plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// By how much, in radians, a direction may miss the cone between the normals beside an edge, or those of a cylinder's
// end and side. Where a face lies on an edge, the direction lies on the cone's border, and either side of it must do;
// and normals of narrow faces are known to no more. At a place where both edges really meet, solids that are outside of
// each other keep the cone; so this admits no false contact.
inline constexpr double askew_rad = 0.02;

// A corner that rests on a plane is furthest along the plane's normal, and that is a sum of the normals of the faces
// that meet there (each times something not negative: the faces that the plane, moved inwards, cuts off around a corner
// have the area of the cut in sum). So it is within the cone around those normals, where that is less than half of all
// directions. The other way round it need not hold: the cone is wider than what it is around.
struct NormalCone {
  // An angle, by its cosine and sine: of a cone, of how far a face's neighbours turn away from it, of how far poses to
  // come may turn. From some 60° on it is any: three of those that are less stay below half a turn in sum.
  struct Angle {
    static constexpr double most = 1.0;  // rad
    double cosine = any, sine = 0.0;
    static Angle of(double angle) noexcept { return angle < most ? Angle{std::cos(angle), std::sin(angle)} : Angle{}; }
    // Of two unit vectors.
    static Angle between(const Vec3& a, const Vec3& b) noexcept {
      const double cosine = a.dot(b);
      return cosine > 0.0 ? Angle{cosine, a.cross(b).norm()} : Angle{};
    }
    [[nodiscard]] bool is_any() const noexcept { return cosine == any; }
    // A sum of two, as one that more may be added to.
    [[nodiscard]] Angle narrow() const noexcept { return cosine > std::cos(most) ? *this : Angle{}; }
    friend Angle operator+(const Angle& a, const Angle& b) noexcept {
      if (a.is_any() || b.is_any()) return {};
      return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
    }

   private:
    static constexpr double any = 2.0;  // no cosine
  };

  Vec3 axis = Vec3::Zero();
  Angle half{};

  [[nodiscard]] NormalCone seen_by(const Mat3& R) const noexcept { return {R * axis, half}; }
  // Whether a unit direction is in it, or would be after such a turn.
  [[nodiscard]] bool holds(const Vec3& direction, const Angle& turn) const noexcept {
    const Angle most = half + turn;
    return most.is_any() || axis.dot(direction) >= most.cosine;
  }
};

// Of each corner and edge of a body its cone, and of each face how far the normals at its corners turn away from its
// own: a corner of another body that lies on an edge rests on both faces there, and neither normal alone need be in its
// cone.
struct NormalCones {
  std::vector<NormalCone> of_corners;
  std::vector<NormalCone::Angle> around_faces;
  std::vector<NormalCone> of_edges{};
};

// Around the normals beside an edge, and askew_rad beyond them.
inline NormalCone cone_of_edge(const Vec3& left, const Vec3& right) noexcept {
  const Vec3 sum = left + right;
  if (!(sum.norm() > 0.0)) return {};
  const Vec3 axis = sum.normalized();
  return {axis, NormalCone::Angle::of(std::acos(std::clamp(axis.dot(left), -1.0, 1.0)) + askew_rad)};
}

// `each_face` calls with the unit normal and the corners of every face.
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
