// Makes flush solids act as one, by bridging the seams between them.
//
// Why bridges are needed: a point that slides from one box to the next could fall in between. At the common edge, the
// first box lets the point go around the edge. The second box would stop the point only with a side face, which the
// first box hides. In the same way, a point that is pushed along a table against the foot of a box would pass below the
// box.
//
// What a bridge is: a seam is a pair of flat faces in contact. Each seam gets a small solid with the extent of the
// faces' common area. This bridge reaches from one solid into the other and ends where they end. It lies within the two
// solids, except for a gap between them, so it changes nothing else.
//
// Faces are in contact if they are less than joined_m apart. If other faces of such a pair of solids are nearly in one
// plane, with a step of less than joined_m, they are moved into the outer plane, because a point can't pass even the
// smallest step. Boxes that are turned against each other by less than joined_m at their corners are aligned.
//
// These pairs are joined: boxes with parallel edges; a box on a plane; coaxial cylinders; the end of a cylinder that
// lies within a box's face, within another cylinder's end or on a plane. Both objects must be at rest, solid and rigid.
// Objects with layers aren't joined, because two overlapping layers would push twice as hard.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Largest gap or step between flush faces, in metres.
inline constexpr double joined_m = 1e-6;

struct Seam {
  std::int32_t object = 0, with = 0;  // indices in the scene; `object` isn't a plane
  Object bridge;                      // a box or a cylinder, with the friction of `object`
};

struct Joined {
  std::vector<Object> objects;  // the scene's objects in order, with steps removed
  std::vector<Seam> seams;
};

Joined join(const Scene& scene);

}  // namespace proxarm::scenes
