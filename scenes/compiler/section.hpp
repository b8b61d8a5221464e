// Computes sections of a scene by a space of one or two dimensions. A line cuts a convex solid to an interval. A plane
// cuts it to a disc, a rectangle, a stadium or a polygon, and a mesh to segments. An object that moves within the space
// moves as in W.
//
// Results are in coordinates of the space, extruded to three dimensions perpendicular to it. Their normals lie in the
// space, so a 𝒢 of three dimensions can render them (models/surfaces/lower_dimensional.hpp).
#pragma once

#include <optional>
#include <vector>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {

// Returns the section of an object in its described place; empty if the space doesn't meet the object. The object's
// layer keeps its thickness and stiffness. Throws SetupError if a cylinder or capsule is cut obliquely (the section
// would be an ellipse), if the section can't have the layer, or if the whole space lies inside the object.
std::vector<Part> section_of(const Scene& scene, const Object& object);

// Returns the section of a half-space; nullopt if its plane doesn't meet the space. If the plane is oblique to the
// space, the returned normal is shorter than one. Throws SetupError that names `object` if the space lies behind the
// plane.
std::optional<PlaneShape> plane_in_space(const Scene& scene, const Object& object, const PlaneShape& plane);

// Returns an object's motion in coordinates of the space. Throws SetupError if the motion leads out of the space.
models::ScriptedMotion script_in_space(const Scene& scene, const Object& object);

// Returns the part along the space of a pose X_W that is relative to an object's described place.
models::Pose pose_in_space(const Space& space, const models::Pose& X_W) noexcept;

// Returns the scene's guide in coordinates of the space. In two dimensions, a guide on a plane becomes a guide on a
// line. Throws SetupError if the guide isn't in the space, and for any guide in one dimension.
GuideDescription guide_in_space(const Scene& scene);

}  // namespace proxarm::scenes
