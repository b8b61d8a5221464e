// Makes the globe of flat triangles that studies render.
#pragma once

#include <cstdint>
#include <functional>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// Returns a globe with `rings` ≥ 2 steps from pole to pole (± z) and `sectors` ≥ 3 steps around. `place` maps each
// vertex on the unit sphere to the vertex of the mesh.
scenes::MeshShape globe_mesh(std::uint32_t rings, std::uint32_t sectors,
                             const std::function<models::Vec3(const models::Vec3&)>& place);

}  // namespace proxarm::studies
