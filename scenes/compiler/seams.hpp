// Lets flush solids act as one, by bridging the seams between them.
//
// Without bridges, a point that slides from one box to the next could fall in between. At the common edge, the first
// box lets it go around its edge, and the second box stops it only with a side that the first hides. Likewise, a point
// pushed along a table against the foot of a box would pass below the box. So each seam, a pair of flat faces in
// contact, gets a small solid with the extent of their common area. It reaches from one solid into the other and ends
// where they end. It lies within both, except for a gap between them, so nothing else changes.
//
// Faces are in contact if they are less than joined_m apart. If other faces of such a pair are nearly in one plane,
// with a step of less than joined_m, they are moved to the outer one: a point can't pass even the smallest step. Boxes
// turned against each other by less than joined_m at their corners are aligned.
//
// Joined are boxes with parallel edges, a box on a plane, coaxial cylinders, and a cylinder's end within a box's face,
// another cylinder's end or a plane. All must be at rest, solid and rigid: two overlapping layers would push twice as
// hard.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Largest gap or step between flush faces, metres.
inline constexpr double joined_m = 1e-6;

struct Seam {
  std::int32_t object = 0, with = 0;  // indices in the scene; the first isn't a plane
  Object bridge;                      // a box or a cylinder, with the friction of `object`
};

struct Joined {
  std::vector<Object> objects;  // the scene's objects in order, with steps removed
  std::vector<Seam> seams;
};

Joined join(const Scene& scene);

}  // namespace proxarm::scenes
