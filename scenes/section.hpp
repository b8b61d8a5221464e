// What a space of one or two dimensions has of a solid: a line cuts a convex one to an interval, a plane to a disc, a
// rectangle or a stadium where it lies straight in it, and a mesh to segments.
#pragma once

#include <vector>

#include "scenes/obstacles.hpp"

namespace proxarm::scenes {

// The parts of an object that stands still and has no layer, in coordinates of the space, lifted to three; none if they
// don't meet. Throws SetupError for a plane that cuts it askew (an ellipse), for regions of friction on a mesh, and
// where the space lies in what the object leaves no room in.
std::vector<Part> section_of(const Scene& scene, const Object& object);

}  // namespace proxarm::scenes
