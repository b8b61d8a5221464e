// Measures how far a mesh is from convex: the depth of its deepest dent below its convex hull.
#pragma once

#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::scenes {

// The largest distance, in metres, of a point of the mesh from the surface of its hull; at most 1 % too small. By
// branch and bound over the triangles. Precondition: `hull` is the hull of the mesh's vertices.
double deepest_dent_m(const models::TriangleMesh& mesh, const models::Solid& hull);

}  // namespace proxarm::scenes
