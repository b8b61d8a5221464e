// Turns a scene's shapes into the obstacles that a World is made of.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/obstacles/obstacle.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// One obstacle of an object. A box or a cylinder seen from inside is made of several.
struct Part {
  std::unique_ptr<models::Obstacle> obstacle;
  std::int32_t feature = -1;  // the feature that contacts report; −1: the obstacle's own
};

// The parts of an object at rest, in W. Throws SetupError for a layer on a mesh, and for one that is too thick for its
// object.
std::vector<Part> parts_of(const Scene& scene, const Object& object);

// The error to throw for something at `line` of the scene that can't be rendered.
description::SetupError refusal(const Scene& scene, int line, std::string message, std::string advice);

// The object's layer; {} if it has none. `thickness_m` is how thick the solid below it is, 0 if that can't have a
// layer. Throws SetupError with `expected` if the layer is half as thick as that or thicker.
models::Layer layer_on(const Scene& scene, const Object& object, double thickness_m, const std::string& expected);

// Friction by face of a mesh with regions; empty for any other object. Throws SetupError for a region without a
// triangle.
std::vector<double> friction_by_face(const Scene& scene, const Object& object);

// The same shape as a region of space: solid, without friction.
std::unique_ptr<models::Obstacle> region_of(const Shape& shape);

models::ScriptedMotion script_of(const Motion& motion);

// The middle of a shape, and about how far it reaches from there (half a metre for a plane).
models::Vec3 middle_of(const Shape& shape);
double size_of(const Shape& shape);

// Whether a tool or a proxy is held inside of a shape.
bool is_inside_out(const Shape& shape);

// Signed distance from the rigid part of an object that stands where it was described.
double distance_to(const Object& object, const models::Vec3& x_W);

}  // namespace proxarm::scenes
