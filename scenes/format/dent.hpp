// Measures how far a mesh is from being convex: the depth of its deepest dent below its convex hull.
#pragma once

#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::scenes {

// Returns the largest distance of a point of the mesh from the surface of the hull, in metres; at most 1 % too small.
// Method: branch and bound over the triangles. Precondition: `hull` is the convex hull of the mesh's vertices.
double deepest_dent_m(const models::TriangleMesh& mesh, const models::Solid& hull);

}  // namespace proxarm::scenes
