// The elastic layers that a proxy can press at the same time, as springs, to judge stability in contact with them.
//
// A flat face has its normal. On a sphere or another round shape the normal can have any direction: seven lines
// represent all, the edges and diagonals of a cube. The same holds for the round side of a cylinder, and for turning
// objects.
//
// Layers press together if their solids overlap: two or three flat faces, each with its normal. A round shape beside
// another layer is assumed to press along the same line, which is the stiffest combination.
#pragma once

#include <string>
#include <vector>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// A layer at a place where it is pressed.
struct PressedLayer {
  std::string object;  // its name
  double stiffness_N_per_m = 0.0;
  double friction = 0.0;
  models::Vec3 normal_W = models::Vec3::UnitZ();  // unit, of either sign
};

// One layer, or several that press at once.
using LayersTogether = std::vector<PressedLayer>;

// All touches of a scene, single layers first. At most `most`, the stiffest ones. Directions out of the scene's space
// are left out.
inline constexpr std::size_t most_touches = 48;
std::vector<LayersTogether> layer_touches(const Scene& scene, std::size_t most = most_touches);

}  // namespace proxarm::scenes
