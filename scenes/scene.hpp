// A virtual world as its file states it: plain numbers, no behaviour. Loaded by load_scene() or filled in by hand, made
// into a 𝒢 by compile().
//
// Metres, newtons, radians; all positions and directions in W unless a name says otherwise.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/geometry.hpp"

namespace proxarm::scenes {

// Where the proxy lives: all of W (three dimensions), a plane of it (two) or a line (one). A point of the space with
// coordinates ξ is at origin_m + axes ξ in W.
struct Space {
  int dimensions = 3;  // 1, 2 or 3
  models::Vec3 origin_m = models::Vec3::Zero();
  models::Mat3 axes = models::Mat3::Identity();  // orthonormal columns; the first `dimensions` span the space
};

// The half-space behind a flat surface.
struct PlaneShape {
  models::Vec3 point_m = models::Vec3::Zero();
  models::Vec3 normal = models::Vec3::UnitZ();  // any length but zero; points to the free side
};

using Shape = std::variant<PlaneShape>;

struct Object {
  std::string name;  // unique in a scene; "plane 1" where the file gives none
  Shape shape;
  double friction = 0.0;  // μ, no unit
  int line = 0;           // in the scene's file, for messages; 0: unknown
};

struct Scene {
  std::filesystem::path file;  // empty if it wasn't loaded
  std::string name;
  Space space;
  std::vector<Object> objects;
  std::optional<double> coulomb_force_N;  // dry friction everywhere, equation (3)
  int coulomb_line = 0;
};

// What a shape is called in files and messages: "plane".
std::string kind_of(const Shape& shape);

}  // namespace proxarm::scenes
