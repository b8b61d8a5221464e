// A convex solid as its features: points, edges and faces, each with the same radius around it. A sphere is a point
// with a radius, a capsule an edge with its ends, a box and a hull have faces and no radius. A flat cylinder has two
// rims instead.
//
// Contact is found between features, because a feature pair has a gap in closed form, exact to rounding. Metres; built
// once, then constant.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "models/geometry/geometry.hpp"
#include "models/rigid_shapes/normal_cone.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

struct Solid {
  struct Edge {
    std::uint32_t from = 0, to = 0;  // points
    // The normals of the faces on either side, unit. Without faces (a capsule), zero.
    Vec3 left = Vec3::Zero(), right = Vec3::Zero();
  };
  struct Face {
    Vec3 normal = Vec3::UnitZ();         // unit, outwards
    double offset = 0.0;                 // normalᵀ x on the face
    std::uint32_t first = 0, count = 0;  // its corners in `ring`, counter-clockwise from outside
  };
  struct Rim {
    Vec3 centre = Vec3::Zero();
    Vec3 u = Vec3::UnitX(), v = Vec3::UnitY();  // unit, across the axis
    double radius = 0.0;
  };
  struct Around {  // a box
    Vec3 low, high;
  };

  std::vector<Vec3> points;
  NormalCones cones;  // of its points and faces
  std::vector<Edge> edges;
  std::vector<Face> faces;
  std::vector<std::uint32_t> ring;
  std::vector<Rim> rims;
  std::vector<Around> around_edges, around_faces;  // without the radius, for first looks. Of a mesh as a tool, none
  double radius = 0.0;
  double reach = 0.0;  // the largest distance of a point of the solid from the frame's origin

  [[nodiscard]] std::span<const std::uint32_t> corners(const Face& face) const noexcept {
    return std::span(ring).subspan(face.first, face.count);
  }
};

// In the frame that X leads to. Throws std::invalid_argument: sizes that aren't positive, or points that span no solid.
Solid solid_of(const SphereTool& shape, const Pose& X);
Solid solid_of(const CapsuleTool& shape, const Pose& X);
Solid solid_of(const BoxTool& shape, const Pose& X);
Solid solid_of(const CylinderTool& shape, const Pose& X);
Solid solid_of(const ConvexTool& shape, const Pose& X);  // points inside of the hull are left out

// How far a tool's shapes come from its reference point. Throws as solid_of().
double reach_of(const Tool& tool);

}  // namespace proxarm::models
