// Tolerances, and helpers for poses and features, that several sources of RigidWorld use.
#pragma once

#include <algorithm>

#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/rigid_object.hpp"

namespace proxarm::models {

// If a feature is within this distance of a face, m, rounding may have changed on which side of the face it seems to
// be. A feature that touched the face then keeps its former side.
inline constexpr double kFront_m = 1e-9;
inline constexpr double kGap_m = 1e-12;  // how far a gap may be below 0, m

// A rim counts as level if its lowest point is less than this below its centre, m: a tenth of kGap_m.
inline constexpr double kLevel_m = 1e-13;

// The pose of the tool, in W or in an object's frame, as a matrix and a vector.
struct View {
  Mat3 R = Mat3::Identity();
  Vec3 x = Vec3::Zero();
  [[nodiscard]] Vec3 operator*(const Vec3& p) const noexcept { return R * p + x; }
  [[nodiscard]] Vec3 to_T(const Vec3& p) const noexcept { return R.transpose() * (p - x); }
};

inline View inverse(const View& at) noexcept { return {at.R.transpose(), at.to_T(Vec3::Zero())}; }
inline Pose isometry(const View& at) noexcept {
  Pose X = Pose::Identity();
  X.linear() = at.R;
  X.translation() = at.x;
  return X;
}
inline View view(const ToolPose& pose) noexcept { return {pose.orientation.toRotationMatrix(), pose.position}; }
inline EdgeLine edge_of(const Solid& solid, std::uint32_t i) noexcept {
  const Solid::Edge& e = solid.edges[i];
  return {solid.points[e.from], solid.points[e.to], e.left, e.right, false};
}

// Whether a point lies in front of some face of a convex solid without a radius, and so outside of the solid.
inline bool is_outside(const Solid& solid, const Vec3& p) noexcept {
  return std::any_of(solid.faces.begin(), solid.faces.end(),
                     [&](const Solid::Face& face) { return face.normal.dot(p) - face.offset > kGap_m; });
}

inline EdgeLine moved_edge(const EdgeLine& edge, const View& at) noexcept {
  return {at * edge.from, at * edge.to, at.R * edge.left, at.R * edge.right, edge.open};
}
// Returns an edge in T. `outwards` is −1 if the normals of the faces must be reversed, else 1.
inline EdgeLine edge_in_T(const EdgeLine& edge, const View& at, double outwards) noexcept {
  const Mat3 R = at.R.transpose();
  return {at.to_T(edge.from), at.to_T(edge.to), outwards * (R * edge.left), outwards * (R * edge.right), edge.open};
}

inline const TriangleMesh::Face& face_of(const TriangleFeatures& mesh, std::uint32_t i) noexcept {
  return mesh.mesh().face(i);
}

}  // namespace proxarm::models
