// A rigid tool and a world for it, drawn at random.
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

// One to four planes, or two to six solids (boxes, spheres and capsules; boxes alone for a convex tool), or one hollow
// box, sphere, capsule or cylinder, with a tool that fits in. Tools of 3 to 60 mm: sphere, capsule, box, convex, or two
// of them. Nothing moves.
RandomToolScene random_tool_scene(Random& random);

// The same with closed meshes of 20 to 350 triangles, rough balls and stars with dents: as an object, as the tool, or
// both, beside up to two solids or planes.
RandomToolScene random_mesh_tool_scene(Random& random);

// Three objects in four begin to move: to and fro by 1 mm/s to 0.3 m/s at 0.3 to 8 Hz, straight ahead by up to 20 mm/s,
// or about an axis through their middle by up to 3 rad/s (planes: about their normal).
void set_in_motion(Random& random, scenes::Scene& scene);

}  // namespace proxarm::studies
