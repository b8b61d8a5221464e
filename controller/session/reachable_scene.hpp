// Restricts a scene to what an arm can render.
#pragma once

#include "models/description/cell.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Returns the scene. If the scene is empty and the arm can't move in all directions, the scene's space becomes the line
// or plane that the tool can reach.
scenes::Scene reachable_scene(scenes::Scene scene, const description::Cell& cell);

}  // namespace proxarm::controller
