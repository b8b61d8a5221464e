// From a scene's shapes to what a World is made of.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/description/setup_error.hpp"
#include "models/moving_obstacle.hpp"
#include "models/obstacle.hpp"
#include "scenes/scene.hpp"

namespace proxarm::scenes {

// One obstacle of an object; several make a box or a cylinder that is seen from inside.
struct Part {
  std::unique_ptr<models::Obstacle> obstacle;
  std::int32_t feature = -1;  // to be reported; −1: the obstacle's own
};

// The parts of an object in W, standing still. Throws SetupError for what can't be: a layer on a mesh, or as thick as
// what it is on.
std::vector<Part> parts_of(const Scene& scene, const Object& object);

// To be thrown for what a scene says there, which can't be.
description::SetupError refusal(const Scene& scene, int line, std::string message, std::string advice);

// The object's layer, on what is so thick (0: on what can have none); throws SetupError, with what was expected, where
// it is half as thick as that or thicker. {}: it has none.
models::Layer layer_on(const Scene& scene, const Object& object, double thickness_m, const std::string& expected);

// Friction by face of a mesh with regions; empty for any other object. Throws SetupError for a region without a
// triangle.
std::vector<double> friction_by_face(const Scene& scene, const Object& object);

// The same shape as a region: solid, without friction.
std::unique_ptr<models::Obstacle> region_of(const Shape& shape);

models::ScriptedMotion script_of(const Motion& motion);

// Where to look for an object, and about how far it reaches from there (half a metre for a plane).
models::Vec3 middle_of(const Shape& shape);
double size_of(const Shape& shape);

// Signed distance from an object that stands where it was described; to what is rigid of it.
double distance_to(const Object& object, const models::Vec3& x_W);

}  // namespace proxarm::scenes
