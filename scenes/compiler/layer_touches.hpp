// The elastic layers that a proxy can press on at once, as springs: for the stability of what is felt there.
//
// A flat face has its normal. On a sphere, or on what else is round, the normal can point anywhere: seven lines stand
// for all, the cube's edges and diagonals. The round side of a cylinder is judged so, too, and so is what turns.
//
// Layers press together where their solids overlap: two or three flat faces with a normal each. Something round beside
// another layer is taken to press along the same line: the stiffest that the two can be.
#pragma once

#include <string>
#include <vector>

#include "models/geometry/geometry.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// A layer where it is pressed on.
struct PressedLayer {
  std::string object;  // its name
  double stiffness_N_per_m = 0.0;
  double friction = 0.0;
  models::Vec3 normal_W = models::Vec3::UnitZ();  // unit, of either sign
};

// One layer, or several that press at once.
using LayersTogether = std::vector<PressedLayer>;

// All of a scene, single ones first. At most `most`: where a scene has more, the stiffest. Directions out of the
// scene's space are left out.
inline constexpr std::size_t most_touches = 48;
std::vector<LayersTogether> layer_touches(const Scene& scene, std::size_t most = most_touches);

}  // namespace proxarm::scenes
