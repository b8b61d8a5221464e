#include "scenes/scene_file.hpp"

#include <Eigen/LU>
#include <cmath>
#include <set>

#include "models/description/yaml_file.hpp"

namespace proxarm::scenes {
namespace {

using description::above;
using description::between;
using description::YamlNode;
using models::Vec3;

// Coordinates beyond a hundred kilometres are a mistake of the unit, and would cost the proxy its exactness.
constexpr description::Range kCoordinate = between(-1e5, 1e5);
constexpr description::Range kFriction = between(0.0, 100.0);

Vec3 vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

Vec3 direction_of(const YamlNode& node, std::string_view key) {
  const Vec3 v = vector_of(node.vec3(key, kCoordinate));
  if (!(v.norm() > 0.0))
    throw node.error_at(key, "a direction: three numbers, not all zero", "a vector of length zero");
  return v;
}

PlaneShape read_plane(const YamlNode& node) {
  return {.point_m = vector_of(node.vec3("point_m", kCoordinate)), .normal = direction_of(node, "normal")};
}

Shape read_shape(const std::string& kind, const YamlNode& node) {
  (void)kind;
  return read_plane(node);
}

const std::vector<std::string>& kinds() {
  static const std::vector<std::string> all{"plane"};
  return all;
}

Object read_object(const YamlNode& entry) {
  if (!entry.is_map()) throw entry.error("an object, such as `plane: {point_m: [0, 0, 0], normal: [0, 0, 1]}`");
  for (const std::string& kind : kinds()) {
    const auto node = entry.find_map(kind);
    if (!node) continue;
    Object object;
    object.line = node->line();
    object.shape = read_shape(kind, *node);
    object.name = node->string_or("name", "");
    object.friction = node->number_or("friction", 0.0, kFriction);
    return object;
  }
  entry.finish();  // names an unknown kind, and the nearest known one
  throw entry.error("an object: one of plane", "an empty map");
}

Space read_space(const YamlNode& root) {
  Space space;
  space.dimensions = static_cast<int>(root.integer_or("dimensions", 3, 1, 3));
  const auto node = root.find_map("space");
  if (!node) {
    if (space.dimensions < 3) {
      throw root.error_at("space", "origin_m and axes of the line or plane that the proxy lives on", "nothing");
    }
    return space;
  }
  space.origin_m = vector_of(node->vec3_or("origin_m", {0, 0, 0}, kCoordinate));
  const auto axes =
      node->list("axes", static_cast<std::size_t>(space.dimensions), static_cast<std::size_t>(space.dimensions));
  // Gram-Schmidt, so that axes that are given in round numbers span what they say.
  for (int i = 0; i < space.dimensions; ++i) {
    const YamlNode& axis_node = axes[static_cast<std::size_t>(i)];
    Vec3 axis = vector_of(axis_node.as_vec3(kCoordinate));
    const double length = axis.norm();
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < i; ++j) axis -= space.axes.col(j) * space.axes.col(j).dot(axis);
    }
    // Six digits of a right angle: less would make distances in the space differ from those in W by more than it takes
    // to notice, and is a mistake rather than a rounded number.
    if (!(axis.norm() > 0.0) || axis.norm() < length * (1.0 - 1e-6)) {
      throw axis_node.error("axes of nonzero length, at right angles to each other");
    }
    space.axes.col(i) = axis.normalized();
  }
  if (space.dimensions < 3) {
    // The rest of the basis is never used but as a full rotation by those who draw.
    const Vec3 x = space.axes.col(0);
    if (space.dimensions == 1) space.axes.col(1) = x.unitOrthogonal();
    space.axes.col(2) = x.cross(Vec3(space.axes.col(1)));
  }
  return space;
}

Scene read_scene(const YamlNode& root) {
  Scene scene;
  scene.file = root.file();
  scene.name = root.string_or("name", root.file().stem().string());
  scene.space = read_space(root);
  std::set<std::string> names;
  if (root.has("objects")) {
    for (const YamlNode& entry : root.list("objects", 0, 1'000'000)) {
      Object object = read_object(entry);
      const bool named = !object.name.empty();
      if (!named) object.name = kind_of(object.shape) + " " + std::to_string(scene.objects.size() + 1);
      if (!names.insert(object.name).second) {
        throw entry.error("a name of its own for each object", object.name);
      }
      scene.objects.push_back(std::move(object));
    }
  }
  if (const auto field = root.find_map("coulomb_field")) {
    scene.coulomb_force_N = field->number("force_N", above(0.0, 1e6));
    scene.coulomb_line = field->line();
  }
  root.finish();
  return scene;
}

}  // namespace

std::string kind_of(const Shape& /*shape*/) { return "plane"; }

Scene load_scene(const std::filesystem::path& file) { return read_scene(YamlNode::load(file)); }

Scene parse_scene(std::string_view text, const std::filesystem::path& file) {
  return read_scene(YamlNode::parse(text, file));
}

}  // namespace proxarm::scenes
