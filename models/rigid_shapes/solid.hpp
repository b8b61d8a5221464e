// A convex solid as its features: points, edges and faces, all with the same radius around them. A sphere is a point
// with a radius. A capsule is an edge and its two ends with a radius. A box and a hull have points, edges and faces,
// and no radius. A cylinder with flat ends has two rims instead.
//
// Contact is found between features, because the gap of a pair of features has a closed form that is exact to rounding.
// Unit: metres. A solid is built once and then stays constant.
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
    std::uint32_t from = 0, to = 0;  // indices of points
    // Unit normals of the faces on either side of the edge; zero if there are no faces, as in a capsule.
    Vec3 left = Vec3::Zero(), right = Vec3::Zero();
  };
  struct Face {
    Vec3 normal = Vec3::UnitZ();         // unit vector, outwards
    double offset = 0.0;                 // normalᵀ x of all points x on the face
    std::uint32_t first = 0, count = 0;  // the face's corners in `ring`, counter-clockwise as seen from outside
  };
  struct Rim {
    Vec3 centre = Vec3::Zero();
    Vec3 u = Vec3::UnitX(), v = Vec3::UnitY();  // unit vectors, perpendicular to the axis
    double radius = 0.0;
  };
  struct Around {  // a box around a feature
    Vec3 low, high;
  };

  std::vector<Vec3> points;
  NormalCones cones;  // cones of the points, edges and faces
  std::vector<Edge> edges;
  std::vector<Face> faces;
  std::vector<std::uint32_t> ring;
  std::vector<Rim> rims;
  // Boxes around the edges and faces without the radius, for a first, quick test; empty for a mesh as a tool.
  std::vector<Around> around_edges, around_faces;
  double radius = 0.0;
  double reach = 0.0;  // the largest distance of a point of the solid from the frame's origin

  [[nodiscard]] std::span<const std::uint32_t> corners(const Face& face) const noexcept {
    return std::span(ring).subspan(face.first, face.count);
  }
};

// Return the solid in the frame into which X transforms. Throw std::invalid_argument if a size isn't positive or if the
// points span no solid.
Solid solid_of(const SphereTool& shape, const Pose& X);
Solid solid_of(const CapsuleTool& shape, const Pose& X);
Solid solid_of(const BoxTool& shape, const Pose& X);
Solid solid_of(const CylinderTool& shape, const Pose& X);
// Points inside the hull are left out.
Solid solid_of(const ConvexTool& shape, const Pose& X);

// Returns the largest distance of a point of the tool from its reference point. Throws as solid_of() does.
double reach_of(const Tool& tool);

}  // namespace proxarm::models
