// A mesh as a page draws it. Large meshes are made coarser: software rendering takes seconds for a third of a million
// triangles, none of which is then larger than a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "models/geometry/geometry.hpp"

namespace proxarm::view {

// The most triangles that are sent. An object of 0.3 m keeps its shape to about a millimetre.
inline constexpr std::size_t most_triangles = 80'000;

// Packs a mesh for a GPU: uint32 number of vertices, uint32 number of triangles, then float x y z of each vertex and
// uint32 a b c of each triangle. Precondition: corners are indices of vertices.
std::string mesh_picture(std::span<const models::Vec3> vertices,
                         std::span<const std::array<std::uint32_t, 3>> triangles, const models::Vec3& scale);

}  // namespace proxarm::view
