// Finds the pairs of faces of a mesh that are near enough to cross. In any kind of mesh it visits few of all pairs.
#pragma once

#include <functional>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// Calls visit(f, g), f < g, for pairs of faces whose normals are known (Face::trust). These pairs include
//   all pairs that have points within `near_m` of each other, except at corners that they share, and
//   all pairs with the same three corners.
// A pair may be visited more than once. Stops if visit() returns false. Precondition: near_m ≥ mesh.lift_m().
//
// For most meshes, the boxes of the mesh's tree separate the faces. But around a vertex of many faces, and in a tilted
// stack, all boxes meet. If too many boxes meet, space is divided into cells until each cell has few faces; see
// CellSearch. This takes time n log n for fans, cones and parallel sheets of n faces. The time remains quadratic for n
// large faces of different directions that boxes don't separate, such as nested shells.
void each_near_pair(const TriangleMesh& mesh, double near_m,
                    const std::function<bool(std::uint32_t, std::uint32_t)>& visit);

}  // namespace proxarm::models
