// A mesh as a part of the tool.
#pragma once

#include <memory>

#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

// Its triangles in the tool's frame, with their fronts outside, and the same once more as a solid's points, edges and
// faces, by the same numbers. It isn't convex: of its edges only ridges can touch.
struct MeshPart {
  std::shared_ptr<const TriangleFeatures> features;
  Solid solid;
  double thickness_m = 0.0;  // of its thinnest wall
};

// Throws std::invalid_argument for a mesh that is open, and where TriangleMesh and TriangleFeatures do.
MeshPart mesh_part(const MeshTool& shape, const Pose& X);

}  // namespace proxarm::models
