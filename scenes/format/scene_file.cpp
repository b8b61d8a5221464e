#include "scenes/format/scene_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "models/base/text.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"
#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {
namespace {

using description::above;
using description::between;
using description::YamlNode;
using models::Vec3;

// Coordinates beyond a hundred kilometres are taken for a mistake in the unit. Their rounding (1e-11 m) would also make
// the proxy inexact.
constexpr description::Range coordinate_range = between(-1e5, 1e5);
constexpr description::Range friction_range = between(0.0, 100.0);
// A length below a nanometre is taken for a mistake in the unit; an arm knows its position only to micrometres.
constexpr description::Range length_range = between(1e-9, 1e5);
// Corners that are more than ten centimetres apart can't be meant as one corner.
constexpr description::Range weld_range = between(0.0, 0.1);
constexpr description::Range speed_range = between(-100.0, 100.0);

Vec3 vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

Vec3 point_of(const YamlNode& node, std::string_view key) { return vector_of(node.vec3(key, coordinate_range)); }

Vec3 direction_of(const YamlNode& node, std::string_view key) {
  const Vec3 v = point_of(node, key);
  if (!(v.norm() > 0.0))
    throw node.error_at(key, "a direction: three numbers, not all zero", "a vector of length zero");
  return v;
}

PlaneShape read_plane(const YamlNode& node) {
  return {.point_m = point_of(node, "point_m"), .normal = direction_of(node, "normal")};
}

models::Pose pose_of(const YamlNode& node) {
  models::Pose pose = models::Pose::Identity();
  pose.translation() = vector_of(node.vec3_or("position_m", {0, 0, 0}, coordinate_range));
  const Vec3 rpy =
      vector_of(node.vec3_or("rpy_rad", {0, 0, 0}, between(-2.0 * std::numbers::pi, 2.0 * std::numbers::pi)));
  if (rpy.isZero(0.0)) return pose;  // without a rotation, coordinates stay equal to the bit
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Vec3::UnitX()))
                      .toRotationMatrix();
  return pose;
}

MeshPlacement placement_of(const YamlNode& node, const MeshShape& mesh) {
  MeshPlacement placement{mesh.scale_m, mesh.pose_W, {}, mesh.weld_m, mesh.close_holes_m};
  const std::string anchor = node.choice_or("anchor", "origin", {"low", "centre", "origin"});
  if (anchor == "low") placement.anchor = MeshPlacement::Anchor::low;
  if (anchor == "centre") placement.anchor = MeshPlacement::Anchor::centre;
  return placement;
}

MeshShape read_mesh(const YamlNode& node) {
  MeshShape mesh;
  mesh.file = node.existing_file("file");
  mesh.scale_m = node.number_or("scale_m", 1.0, between(1e-6, 1e6));
  mesh.pose_W = pose_of(node);
  mesh.inside_out = node.boolean_or("inside_out", false);
  if (node.has("weld_m")) mesh.weld_m = node.number("weld_m", weld_range);
  mesh.close_holes_m = node.number_or("close_holes_m", 0.0, between(0.0, 1e3));
  LoadedMesh loaded = load_mesh(mesh.file, placement_of(node, mesh));
  mesh.mesh = std::move(loaded.mesh);
  mesh.account = loaded.account;
  if (mesh.inside_out && !mesh.mesh->closed()) {
    throw node.error_at("inside_out", "a closed mesh; both sides of an open one hold anyway", "an open mesh");
  }
  return mesh;
}

BoxShape read_box(const YamlNode& node) {
  BoxShape box;
  box.pose_W.translation() = point_of(node, "centre_m");
  const Vec3 rpy =
      vector_of(node.vec3_or("rpy_rad", {0, 0, 0}, between(-2.0 * std::numbers::pi, 2.0 * std::numbers::pi)));
  box.pose_W.linear() = (Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
                         Eigen::AngleAxisd(rpy.x(), Vec3::UnitX()))
                            .toRotationMatrix();
  box.size_m = vector_of(node.vec3("size_m", length_range));
  box.inside_out = node.boolean_or("inside_out", false);
  return box;
}

SphereShape read_sphere(const YamlNode& node) {
  return {.centre_m = point_of(node, "centre_m"),
          .radius_m = node.number("radius_m", length_range),
          .inside_out = node.boolean_or("inside_out", false)};
}

template <typename Bar>
Bar read_bar(const YamlNode& node, bool may_be_short) {
  Bar bar{.from_m = point_of(node, "from_m"),
          .to_m = point_of(node, "to_m"),
          .radius_m = node.number("radius_m", length_range),
          .inside_out = node.boolean_or("inside_out", false)};
  if (!may_be_short && !((bar.to_m - bar.from_m).norm() >= length_range.min)) {
    throw node.error_at("to_m", "another point than from_m");
  }
  return bar;
}

const std::vector<std::string>& kinds() {
  static const std::vector<std::string> all{"plane", "box", "sphere", "capsule", "cylinder", "mesh"};
  return all;
}

Shape read_shape(const std::string& kind, const YamlNode& node) {
  if (kind == "box") return read_box(node);
  if (kind == "sphere") return read_sphere(node);
  if (kind == "capsule") return read_bar<CapsuleShape>(node, true);
  if (kind == "cylinder") return read_bar<CylinderShape>(node, false);
  if (kind == "mesh") return read_mesh(node);
  return read_plane(node);
}

std::pair<std::string, YamlNode> shape_node(const YamlNode& node) {
  return one_entry(node, kinds(), "an object", "plane: {point_m: [0, 0, 0], normal: [0, 0, 1]}");
}

Motion read_motion(const YamlNode& node) {
  Motion motion;
  motion.driven = node.boolean_or("driven", false);
  motion.velocity_m_per_s = vector_of(node.vec3_or("velocity_m_per_s", {0, 0, 0}, speed_range));
  if (const auto swing = node.find_map("swing")) {
    motion.amplitude_m = vector_of(swing->vec3("amplitude_m", between(-100.0, 100.0)));
    motion.frequency_Hz = swing->number("frequency_Hz", above(0.0, 1000.0));
    motion.phase_rad = swing->number_or("phase_rad", 0.0, between(-10.0, 10.0));
  }
  if (const auto turn = node.find_map("turn")) {
    motion.axis = direction_of(*turn, "axis");
    motion.centre_m = point_of(*turn, "centre_m");
    motion.turn_rad_per_s = turn->number("speed_rad_per_s", speed_range);
  }
  return motion;
}

// Reads the shape of a region, which can't be a mesh.
Shape read_region(const YamlNode& within) {
  if (within.is_map()) refuse_key(within, "mesh", "a box, sphere, capsule, cylinder or plane as a region", "a mesh");
  std::vector<std::string> solid = kinds();
  std::erase(solid, "mesh");
  const auto [kind, shape] = one_entry(within, solid, "a region", "sphere: {centre_m: [0.8, 0, 0.6], radius_m: 0.1}");
  return read_shape(kind, shape);
}

Object read_object(const YamlNode& entry) {
  const auto [kind, node] = shape_node(entry);
  Object object;
  object.line = node.line();
  object.shape = read_shape(kind, node);
  object.name = node.string_or("name", "");
  object.friction = node.number_or("friction", 0.0, friction_range);
  if (kind == "mesh" && node.has("friction_regions")) {
    for (const YamlNode& region : node.list("friction_regions", 1, 1000)) {
      object.friction_regions.push_back({.within = read_region(region.map("within")),
                                         .friction = region.number("friction", friction_range),
                                         .line = region.line()});
    }
  }
  if (kind == "mesh") refuse_key(node, "layer", "a layer on an object that is no mesh", "a layer on a mesh");
  if (const auto layer = node.find_map("layer")) {
    object.layer = ElasticLayer{.thickness_m = layer->number("thickness_m", length_range),
                                .stiffness_N_per_m = layer->number("stiffness_N_per_m", above(0.0, 1e12))};
  }
  if (const auto motion = node.find_map("motion")) object.motion = read_motion(*motion);
  return object;
}

Space read_space(const YamlNode& root) {
  Space space;
  space.dimensions = static_cast<int>(integer_of_or(root, "dimensions", 3, {1, 2, 3}));
  if (space.dimensions < 3) {
    require_key(root, "space", "origin_m and axes of the line or plane that the proxy lives on");
  }
  const auto node = root.find_map("space");
  if (!node) return space;
  space.origin_m = vector_of(node->vec3_or("origin_m", {0, 0, 0}, coordinate_range));
  const auto axes =
      node->list("axes", static_cast<std::size_t>(space.dimensions), static_cast<std::size_t>(space.dimensions));
  // Gram–Schmidt orthonormalisation, because axes in a file are rounded.
  for (int i = 0; i < space.dimensions; ++i) {
    const YamlNode& axis_node = axes[static_cast<std::size_t>(i)];
    Vec3 axis = vector_of(axis_node.as_vec3(coordinate_range));
    const double length = axis.norm();
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < i; ++j) axis -= space.axes.col(j) * space.axes.col(j).dot(axis);
    }
    // Axes must be perpendicular to each other to six digits. A larger deviation is taken for a mistake, not for
    // rounding, and would make distances in the space differ noticeably from those in W.
    if (!(axis.norm() > 0.0) || axis.norm() < length * (1.0 - 1e-6)) {
      throw axis_node.error("axes of nonzero length, at right angles to each other");
    }
    space.axes.col(i) = axis.normalized();
  }
  if (space.dimensions < 3) {
    // The remaining axes only complete the rotation matrix, for drawings and sections.
    const Vec3 x = space.axes.col(0);
    if (space.dimensions == 1) space.axes.col(1) = x.unitOrthogonal();
    space.axes.col(2) = x.cross(Vec3(space.axes.col(1)));
  }
  return space;
}

MediumDescription read_medium(const YamlNode& entry) {
  const auto [kind, node] = one_entry(entry, {"viscous", "coulomb"}, "a medium", "viscous: {damping_Ns_per_m: 20}");
  MediumDescription medium;
  if (kind == "viscous") {
    medium.damping_Ns_per_m = node.number("damping_Ns_per_m", above(0.0, 1e6));
  } else {
    medium.force_N = node.number("force_N", above(0.0, 1e6));
  }
  medium.line = node.line();
  if (const auto within = node.find_map("within")) medium.within = read_region(*within);
  return medium;
}

GuideDescription read_guide(const YamlNode& guide_node) {
  const auto [kind, node] = one_entry(guide_node, {"line", "plane", "polyline"}, "a guide",
                                      "line: {point_m: [0, 0, 0], direction: [1, 0, 0]}");
  GuideDescription guide;
  if (kind == "line") {
    guide.points_m = {point_of(node, "point_m")};
    guide.direction = direction_of(node, "direction");
  } else if (kind == "plane") {
    guide.kind = GuideDescription::Kind::plane;
    guide.points_m = {point_of(node, "point_m")};
    guide.direction = direction_of(node, "normal");
  } else {
    guide.kind = GuideDescription::Kind::polyline;
    for (const YamlNode& point : node.list("points_m", 2, 100'000)) {
      guide.points_m.push_back(vector_of(point.as_vec3(coordinate_range)));
      const std::size_t n = guide.points_m.size();
      if (n > 1 && guide.points_m[n - 1] == guide.points_m[n - 2]) {
        throw point.error("another point than the one before");
      }
    }
    guide.closed = node.boolean_or("closed", false);
    if (guide.closed && guide.points_m.front() == guide.points_m.back()) {
      throw node.error_at("points_m", "a last point that isn't the first again; `closed` leads back to it");
    }
  }
  guide.friction = node.number_or("friction", 0.0, friction_range);
  guide.line_number = node.line();
  return guide;
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
      if (object.name.empty()) object.name = kind_of(object.shape) + " " + std::to_string(scene.objects.size() + 1);
      if (!names.insert(object.name).second) throw entry.error("a name of its own for each object", object.name);
      scene.objects.push_back(std::move(object));
    }
  }
  if (root.has("media")) {
    for (const YamlNode& entry : root.list("media", 0, 1000)) scene.media.push_back(read_medium(entry));
  }
  if (const auto field = root.find_map("coulomb_field")) {
    scene.coulomb_force_N = field->number("force_N", above(0.0, 1e6));
    scene.coulomb_line = field->line();
  }
  if (const auto guide = root.find_map("guide")) scene.guide = read_guide(*guide);
  if (const auto tool = root.find_map("tool")) scene.tool = std::make_shared<const RigidTool>(read_tool(*tool));
  root.finish();
  return scene;
}

}  // namespace

std::string kind_of(const Shape& shape) { return kinds()[shape.index()]; }

Scene load_scene(const std::filesystem::path& file) { return read_scene(YamlNode::load(file)); }

Scene load_scene_with(const std::filesystem::path& file, const std::filesystem::path& tool) {
  Scene scene = load_scene(file);
  if (tool == file) return scene;
  scene.tool = tool.empty() ? nullptr : std::make_shared<const RigidTool>(load_tool(tool));
  return scene;
}

Scene parse_scene(std::string_view text, const std::filesystem::path& file) {
  return read_scene(YamlNode::parse(text, file));
}

}  // namespace proxarm::scenes
