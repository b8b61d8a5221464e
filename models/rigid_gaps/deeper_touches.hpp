// Of the touches of features that the tool is behind: which of them hold it, and which normals are lawful.
#pragma once

#include "models/rigid_gaps/touches.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

// Drops touches of features that the tool is behind but that don't hold it: of all faces that a point is under, only
// the one that it is least deep under does.
void drop_deeper(const RigidBodies& bodies, const Candidates& candidates, const View& at, Touches& touches) noexcept;
// Whether one of the two convex bodies that touch reaches beyond the plane between them: then the normal is outside of
// the cone of normals that this body has there. This is so where a corner has its foot on a face, on the border of that
// face or on the rim of a cylinder's side, while the corner's own edges lead away.
[[nodiscard]] bool reaches_beyond(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                  const View& at) noexcept;

}  // namespace proxarm::models
