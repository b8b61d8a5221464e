// Draws random worlds for the stress study.
#pragma once

#include <string>

#include "models/base/random.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

using models::Random;

struct RandomScene {
  scenes::Scene scene;
  std::string kind;  // planes, round, edged, several, moving, media, layer, guide, mesh
};

RandomScene random_scene(Random& random);

// Draws a world with a concave mesh (kind concave_mesh) or a moving mesh (kind moving_mesh). Half of these worlds have
// another object.
RandomScene random_mesh_scene(Random& random);

// Draws a world of two to five objects, most of them with elastic layers. In kind `layers` all objects stand, in kind
// `moving_layers` some objects move.
RandomScene random_layer_scene(Random& random);

}  // namespace proxarm::studies
