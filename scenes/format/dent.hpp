// How deep the dents of a mesh are: what its convex hull would fill.
#pragma once

#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::scenes {

// The largest distance of a point of the mesh from the surface of its hull, found to 1 %: at most what it is. By branch
// and bound over the triangles. Precondition: `hull` is that of the mesh's vertices.
double deepest_dent_m(const models::TriangleMesh& mesh, const models::Solid& hull);

}  // namespace proxarm::scenes
