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

// One obstacle of an object. A box or cylinder seen from inside consists of several.
struct Part {
  std::unique_ptr<models::Obstacle> obstacle;
  std::int32_t feature = -1;  // feature reported by contacts; −1: the obstacle's own
};

// The parts of an object in its described place, in W. Throws SetupError for a layer on a mesh, and for a layer too
// thick for its object.
std::vector<Part> parts_of(const Scene& scene, const Object& object);

// The error to throw for something at `line` of the scene that can't be rendered.
description::SetupError refusal(const Scene& scene, int line, std::string message, std::string advice);

// The object's layer; {} if it has none. `thickness_m`: thickness of the solid below the layer, 0 if it can't have one.
// Throws SetupError with `expected` if the layer is at least half as thick.
models::Layer layer_on(const Scene& scene, const Object& object, double thickness_m, const std::string& expected);

// Friction by face of a mesh with regions; empty for other objects. Throws SetupError for a region without a triangle.
std::vector<double> friction_by_face(const Scene& scene, const Object& object);

// The shape as a region of space: solid, without friction.
std::unique_ptr<models::Obstacle> region_of(const Shape& shape);

models::ScriptedMotion script_of(const Motion& motion);

// Centre of a shape, and its approximate reach from there (half a metre for a plane).
models::Vec3 middle_of(const Shape& shape);
double size_of(const Shape& shape);

// True if the shape is a cavity that holds tool or proxy inside.
bool is_inside_out(const Shape& shape);

// Signed distance to the rigid part of an object in its described place.
double distance_to(const Object& object, const models::Vec3& x_W);

}  // namespace proxarm::scenes
