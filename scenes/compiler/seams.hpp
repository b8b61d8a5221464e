// Solids that stand flush hold as one.
//
// A point that slides from one box over to the next comes to the place where both end. There the first lets it go
// around its edge, and the second stops it with the side that the first hides: it would fall in between. So would a
// point that is pushed along a table against the foot of a box: it would pass below. Each pair of flat faces that lie
// upon one another is a seam, and is closed by a small solid of the size of what they share, which reaches from one
// into the other and ends where they end. Nothing else changes: it is within the two, but for a gap between them.
//
// Faces lie upon one another if they are less than joined_m apart. Where other faces of such a pair are nearly in one
// plane, a step of less than joined_m, they are put into the outer one: no step is small enough for a point to get
// over. Boxes that are turned against each other by less than joined_m at their corners are turned alike.
//
// Joined are boxes, the ends of cylinders, and planes: boxes whose edges are parallel, a box on a plane, cylinders on
// one axis, and a cylinder's end that lies within a box's face, another cylinder's end or a plane. All stand still, are
// solid and rigid: two layers that overlap would push twice as hard.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// The largest gap or step between faces that hold as one, metres.
inline constexpr double joined_m = 1e-6;

struct Seam {
  std::int32_t object = 0, with = 0;  // indices in the scene; the first isn't a plane
  Object bridge;                      // a box or a cylinder, with the friction of `object`
};

struct Joined {
  std::vector<Object> objects;  // those of the scene, in order, with their steps taken out
  std::vector<Seam> seams;
};

Joined join(const Scene& scene);

}  // namespace proxarm::scenes
