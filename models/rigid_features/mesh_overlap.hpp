// Whether what should be apart stands in a mesh, for setting up.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// What counts as apart: a triangle that stands in the solid by no more than −`enough`. Those are looked for first by
// planes with such normals, of the mesh's frame.
struct Apart {
  double enough = 0.0;
  std::span<const Vec3> normals{};
};

// The deepest that a solid (with the box of its points; `at` leads from its frame to the mesh's) stands in any triangle
// of a mesh, or how far its first point is from the surface if it isn't inside or outside as it should be. Negative; 0
// if neither. An open mesh has no inside.
double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart = {}) noexcept;
// Of two meshes the same; the own one is a closed body.
double overlap_of_meshes(const FlatMesh& own, const FlatMesh& other, const View& at,
                         std::optional<bool> should_be_inside) noexcept;
// The two things that it looks at: one triangle of each, and whether one mesh is all on the wrong side of the other.
double overlap_of_faces(const TriangleMesh& own, std::uint32_t face, const TriangleMesh& other,
                        std::uint32_t other_face, const View& at) noexcept;
double overlap_of_all(const TriangleMesh& own, const TriangleMesh& other, const View& at,
                      std::optional<bool> should_be_inside) noexcept;

}  // namespace proxarm::models
