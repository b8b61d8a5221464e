// Sections of a scene by a space of one or two dimensions. A line cuts a convex solid to an interval. A plane cuts it
// to a disc, a rectangle, a stadium or a polygon, and a mesh to segments. An object that moves within the space moves
// as in W.
//
// Results are in coordinates of the space, extruded to three dimensions across it. Their normals lie in the space, so a
// 𝒢 of three dimensions renders them (models/surfaces/lower_dimensional.hpp).
#pragma once

#include <optional>
#include <vector>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {

// The section of an object in its described place; empty if the space doesn't meet it. The object's layer keeps its
// thickness and stiffness on the section. Throws SetupError for an oblique cut of a cylinder or capsule (an ellipse),
// for a layer that the section can't have, and for a space wholly inside the object.
std::vector<Part> section_of(const Scene& scene, const Object& object);

// The section of a half-space; nullopt if its plane doesn't meet the space. The normal is shorter than one if the cut
// is oblique. Throws SetupError, naming `object`, if the space lies behind the plane.
std::optional<PlaneShape> plane_in_space(const Scene& scene, const Object& object, const PlaneShape& plane);

// An object's motion in coordinates of the space. Throws SetupError for a motion out of the space.
models::ScriptedMotion script_in_space(const Scene& scene, const Object& object);

// The part along the space of a pose relative to an object's described place.
models::Pose pose_in_space(const Space& space, const models::Pose& X_W) noexcept;

// The scene's guide in coordinates of the space; in two dimensions, a guide on a plane becomes one on a line. Throws
// SetupError for a guide outside of the space, and for any guide in one dimension.
GuideDescription guide_in_space(const Scene& scene);

}  // namespace proxarm::scenes
