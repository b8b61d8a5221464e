// Restricts a scene to what an arm can render.
#pragma once

#include "models/description/cell.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// An empty scene becomes the line or plane that the tool can reach, if the arm can't move in all directions. Any other
// scene is returned unchanged.
scenes::Scene reachable_scene(scenes::Scene scene, const description::Cell& cell);

}  // namespace proxarm::controller
