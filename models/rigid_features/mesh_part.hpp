// Prepares a mesh as a part of the tool.
#pragma once

#include <memory>

#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

// A mesh in the tool's frame, stored twice: as triangles whose fronts are outside, and as a solid whose points, edges
// and faces have the same indices. The solid isn't convex: only those of its edges that are ridges can touch an object.
struct MeshPart {
  std::shared_ptr<const TriangleFeatures> features;
  Solid solid;
  double thickness_m = 0.0;  // thickness of the mesh's thinnest wall
};

// Returns a mesh as a part of the tool. X transforms from the mesh's frame into the tool's. Throws
// std::invalid_argument if the mesh is open, or if the constructor of TriangleMesh or TriangleFeatures throws it.
MeshPart mesh_part(const MeshTool& shape, const Pose& X);

}  // namespace proxarm::models
