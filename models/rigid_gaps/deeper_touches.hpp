// Decides which of the features that the tool is behind hold the tool, and which normals of touches are correct.
#pragma once

#include "models/rigid_gaps/touches.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

// Drops the touches of features that the tool is behind and that don't hold the tool. Example: if a point is behind
// several faces of a solid, only the face under which the point is least deep holds it.
void drop_deeper(const RigidBodies& bodies, const Candidates& candidates, const View& at, Touches& touches) noexcept;
// Whether one of the two touching convex bodies reaches beyond the plane of contact. The normal then isn't in the cone
// of normals that this body has at the place of contact, so the contact is false. This happens if the foot of a corner
// lies on a face, on a face's border or at an end of a cylinder's side, while the body of the corner extends to the
// other side of the plane.
[[nodiscard]] bool reaches_beyond(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                  const View& at) noexcept;

}  // namespace proxarm::models
