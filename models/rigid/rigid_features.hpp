// What the sources of RigidWorld have in common.
#pragma once

#include "models/rigid/rigid_object.hpp"

namespace proxarm::models {

// Which side of a face a feature within this of it was on, rounding may have turned round: if it touched, it stays
// there.
inline constexpr double kFront_m = 1e-9;
inline constexpr double kGap_m = 1e-12;  // what a gap may be short of

// A rim whose lowest point is lower than its middle by less is level: a tenth of what a gap may be short of.
inline constexpr double kLevel_m = 1e-13;

inline EdgeLine edge_of(const Solid& solid, std::uint32_t i) noexcept {
  const Solid::Edge& e = solid.edges[i];
  return {solid.points[e.from], solid.points[e.to], e.left, e.right, false};
}

inline const TriangleMesh::Face& face_of(const TriangleFeatures& mesh, std::uint32_t i) noexcept {
  return mesh.mesh().face(i);
}

}  // namespace proxarm::models
