// Packs a mesh for display. Large meshes are made coarser: software rendering would take seconds for 300,000 triangles,
// and each triangle would be smaller than a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "models/geometry/geometry.hpp"

namespace proxarm::view {

// The largest number of triangles that is sent. With it, an object of 0.3 m keeps its shape to about a millimetre.
inline constexpr std::size_t most_triangles = 80'000;

// Packs a mesh for a GPU: uint32 number of vertices, uint32 number of triangles, float x y z of each vertex, uint32 a b
// c of each triangle. Precondition: the corners of triangles are indices of vertices.
std::string mesh_picture(std::span<const models::Vec3> vertices,
                         std::span<const std::array<std::uint32_t, 3>> triangles, const models::Vec3& scale);

}  // namespace proxarm::view
