// Lists the elastic layers that a proxy can press at the same time, as springs, so that the stability of contact with
// them can be judged.
//
// A flat face has one normal. On a sphere or another round shape the normal can have any direction. These directions
// are represented by seven lines: the directions of the edges and of the diagonals of a cube. The round side of a
// cylinder and turning objects are represented in the same way.
//
// Layers press together if their solids overlap: two or three flat faces, each with its normal. If a round shape is
// beside another layer, both are assumed to press along the same line, which is the stiffest combination.
#pragma once

#include <string>
#include <vector>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// A layer, and the direction in which it is pressed at one place.
struct PressedLayer {
  std::string object;  // name of the object
  double stiffness_N_per_m = 0.0;
  double friction = 0.0;
  models::Vec3 normal_W = models::Vec3::UnitZ();  // unit vector, of either sign
};

// One layer, or several layers that press at once.
using LayersTogether = std::vector<PressedLayer>;

// Returns all combinations of a scene, single layers first. If there are more than `most`, only the stiffest ones are
// returned. Directions out of the scene's space are left out.
inline constexpr std::size_t most_touches = 48;
std::vector<LayersTogether> layer_touches(const Scene& scene, std::size_t most = most_touches);

}  // namespace proxarm::scenes
