// A mesh as a page draws it. Large ones are made coarser: a machine that draws by software takes seconds for a third of
// a million triangles, and none of them is larger than a pixel then.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "models/geometry/geometry.hpp"

namespace proxarm::view {

// Of what is sent; an object of 0.3 m keeps its shape to about a millimetre.
inline constexpr std::size_t most_triangles = 80'000;

// For a GPU: uint32 vertices, uint32 triangles, then float x y z of each vertex and uint32 a b c of each triangle.
// Precondition: corners are indices of vertices.
std::string mesh_picture(std::span<const models::Vec3> vertices,
                         std::span<const std::array<std::uint32_t, 3>> triangles, const models::Vec3& scale);

}  // namespace proxarm::view
