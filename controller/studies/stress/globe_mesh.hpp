// A convex globe of flat triangles, as studies render it.
#pragma once

#include <cstdint>
#include <functional>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// Of `rings` >= 2 steps from pole to pole (± z) and `sectors` >= 3 around; `place` says where a point of the unit
// sphere goes.
scenes::MeshShape globe_mesh(std::uint32_t rings, std::uint32_t sectors,
                             const std::function<models::Vec3(const models::Vec3&)>& place);

}  // namespace proxarm::studies
