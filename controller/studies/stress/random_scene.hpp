// Draws random worlds for the studies.
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

// Worlds of meshes: concave ones and moving ones (kinds concave_mesh, moving_mesh), half of them with another object.
RandomScene random_mesh_scene(Random& random);

// Two to five objects, most of them with elastic layers, some of them moving (kinds layers, moving_layers).
RandomScene random_layer_scene(Random& random);

}  // namespace proxarm::studies
