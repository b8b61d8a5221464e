// Which faces of a mesh are so near one another that they may cross: few of all pairs, in a mesh of any kind.
#pragma once

#include <functional>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// Calls visit(f, g), f < g, for pairs of faces of a known normal (Face::trust). Among them are all that
//   have points within `near_m` of each other, other than corners that they share (what touches in those alone needn't
//   be among them), and all that have the same three corners.
// A pair may be visited more than once. Stops when visit() returns false. Precondition: near_m ≥ mesh.lift_m().
//
// At first by two walks down the mesh's tree, in which boxes keep faces apart: enough for most meshes. Around a vertex
// of many faces, and in a stack that leans, all boxes meet. Where many do, space is divided into cells instead, until
// few faces come into each; see CellSearch. That takes n log n for fans, cones and parallel sheets of n faces. It is
// quadratic still for n large faces of different directions that boxes don't keep apart, such as shells in one another.
void each_near_pair(const TriangleMesh& mesh, double near_m,
                    const std::function<bool(std::uint32_t, std::uint32_t)>& visit);

}  // namespace proxarm::models
