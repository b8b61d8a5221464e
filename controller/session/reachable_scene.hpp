// A scene as an arm can render it.
#pragma once

#include "models/description/cell.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Where there is nothing to touch, the arm's tool may go wherever it can: free space becomes the line or plane of an
// arm that can't move in all directions. Any other scene stays as it is written.
scenes::Scene reachable_scene(scenes::Scene scene, const description::Cell& cell);

}  // namespace proxarm::controller
