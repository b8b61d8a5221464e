// Converts a scene's shapes to the obstacles of a World.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/obstacles/obstacle.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// One obstacle of an object. A box or cylinder seen from inside consists of several parts.
struct Part {
  std::unique_ptr<models::Obstacle> obstacle;
  std::int32_t feature = -1;  // feature that contacts report; −1: the obstacle's own feature
};

// Returns the parts of an object in its described place, in W. Throws SetupError if a mesh has a layer, or if a layer
// is too thick for its object.
std::vector<Part> parts_of(const Scene& scene, const Object& object);

// Returns the error to be thrown if something at `line` of the scene can't be rendered.
description::SetupError refusal(const Scene& scene, int line, std::string message, std::string advice);

// Returns the object's layer; {} if it has none. `thickness_m` is the thickness of the solid below the layer, 0 if the
// object can't have a layer. Throws SetupError with `expected` if the layer's thickness is at least half of it.
models::Layer layer_on(const Scene& scene, const Object& object, double thickness_m, const std::string& expected);

// Returns the friction of each face for a mesh with regions; empty for other objects. Throws SetupError if a region
// contains no triangle.
std::vector<double> friction_by_face(const Scene& scene, const Object& object);

// Returns the shape as a solid region of space, without friction.
std::unique_ptr<models::Obstacle> region_of(const Shape& shape);

models::ScriptedMotion script_of(const Motion& motion);

// Return the centre of a shape, and its approximate reach from the centre (half a metre for a plane).
models::Vec3 middle_of(const Shape& shape);
double size_of(const Shape& shape);

// True if the shape is a cavity that holds the tool or proxy inside.
bool is_inside_out(const Shape& shape);

// Returns the signed distance of x_W to the rigid part of an object in its described place.
double distance_to(const Object& object, const models::Vec3& x_W);

}  // namespace proxarm::scenes
