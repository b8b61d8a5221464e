// Draws a random rigid tool and a world for it.
#pragma once

#include <string>

#include "models/base/random.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

using models::Random;

struct RandomToolScene {
  scenes::Scene scene;
  models::Tool tool;
  std::string kind;  // of the world: planes, solids, boxes, hollow, meshes
};

// One to four planes, or two to six solids (boxes, spheres and capsules; for a convex tool only boxes), or one hollow
// box, sphere, capsule or cylinder with a tool that fits in. Tools of 3 to 60 mm: sphere, capsule, box, convex, or two
// of these. Nothing moves.
RandomToolScene random_tool_scene(Random& random);

// The same with closed meshes of 20 to 350 triangles, as bumpy balls or dented stars: as an object, as the tool, or
// both, with up to two more solids or planes.
RandomToolScene random_mesh_tool_scene(Random& random);

// Sets three objects in four in motion: to and fro with 1 mm/s to 0.3 m/s at 0.3 to 8 Hz, straight ahead with up to 20
// mm/s, or about an axis through their middle with up to 3 rad/s (planes: about their normal).
void set_in_motion(Random& random, scenes::Scene& scene);

}  // namespace proxarm::studies
