// What a space of one or two dimensions has of a scene: a line cuts a convex solid to an interval, a plane to a disc, a
// rectangle, a stadium or a polygon, and a mesh to segments; what moves within the space moves there as it does in W.
//
// All results are in coordinates of the space, lifted to three: the solids of the space, extruded across it. Their
// normals lie in it, so the 𝒢 of three dimensions is that of the space (models/embedded.hpp).
#pragma once

#include <optional>
#include <vector>

#include "scenes/obstacles.hpp"

namespace proxarm::scenes {

// The parts of an object as it is described; none if they don't meet. Its layer, if any, lies on the section, of the
// same thickness and stiffness there. Throws SetupError for a plane that cuts a cylinder or a capsule askew (an
// ellipse), for a layer that the section can't have, and where the space lies in what the object leaves no room in.
std::vector<Part> section_of(const Scene& scene, const Object& object);

// A plane as a space of `dimensions` has it, its normal not of length one where the cut is oblique; none where it
// doesn't meet the space. Throws SetupError where the space lies behind it. `object`: for the message.
std::optional<PlaneShape> plane_in_space(const Scene& scene, const Object& object, const PlaneShape& plane);

// An object's motion. Throws SetupError for one that leads out of the space.
models::ScriptedMotion script_in_space(const Scene& scene, const Object& object);

// The part of a pose (relative to where an object is described) that leads along the space.
models::Pose pose_in_space(const Space& space, const models::Pose& X_W) noexcept;

// The scene's guide; one on a plane is a line in a space of two dimensions. Throws SetupError for one that leads out of
// the space, and for any in one dimension.
GuideDescription guide_in_space(const Scene& scene);

}  // namespace proxarm::scenes
