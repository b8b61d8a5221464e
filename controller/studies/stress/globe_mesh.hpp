// Makes the convex globe of flat triangles that studies render.
#pragma once

#include <cstdint>
#include <functional>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// `rings` ≥ 2 steps from pole to pole (± z), `sectors` ≥ 3 around; `place` maps points of the unit sphere.
scenes::MeshShape globe_mesh(std::uint32_t rings, std::uint32_t sectors,
                             const std::function<models::Vec3(const models::Vec3&)>& place);

}  // namespace proxarm::studies
