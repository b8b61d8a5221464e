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

// Draws a world of one to four planes, or of two to six solids (boxes, spheres and capsules; only boxes if the tool is
// convex), or of one hollow box, sphere, capsule or cylinder that has room for the tool. Tools measure 3 to 60 mm, and
// are a sphere, a capsule, a box, a convex hull, or two of these. No object moves.
RandomToolScene random_tool_scene(Random& random);

// Draws a world with closed meshes of 20 to 350 triangles, which are bumpy balls or dented stars. The object is a mesh,
// or the tool is one, or both are. Up to two further objects are solids or planes. No object moves.
RandomToolScene random_mesh_tool_scene(Random& random);

// Sets each object in motion with a probability of three in four: to and fro with 1 mm/s to 0.3 m/s at 0.3 to 8 Hz,
// straight ahead with up to 20 mm/s, or turning with up to 3 rad/s. An object turns about an axis through its middle, a
// plane about its normal.
void set_in_motion(Random& random, scenes::Scene& scene);

}  // namespace proxarm::studies
