#include "scenes/format/tool_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "models/base/text.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"
#include "models/mesh/mesh_topology.hpp"
#include "models/rigid_shapes/solid.hpp"
#include "scenes/format/dent.hpp"
#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {
namespace {

using description::between;
using description::YamlNode;
using models::Vec3;

// A tool larger than ten metres or smaller than a micrometre is taken for a mistake in the unit.
constexpr description::Range size_range = between(1e-6, 10.0);
constexpr description::Range friction_range = between(0.0, 100.0);
constexpr description::Range weld_range = between(0.0, 0.1);
constexpr std::size_t most_parts = 64, most_vertices = 2000, most_triangles = 20000;

Vec3 vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

models::Pose pose_of(const YamlNode& node) {
  models::Pose pose = models::Pose::Identity();
  pose.translation() = vector_of(node.vec3_or("position_m", {0, 0, 0}, between(-10.0, 10.0)));
  const Vec3 rpy =
      vector_of(node.vec3_or("rpy_rad", {0, 0, 0}, between(-2.0 * std::numbers::pi, 2.0 * std::numbers::pi)));
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Vec3::UnitX()))
                      .toRotationMatrix();
  return pose;
}

// Returns the largest distance of a vertex above a face, for a mesh that should be convex; the direction of the face's
// normal doesn't matter. This distance isn't the depth of a dent: above a slanted face in a dent of 5 mm, a vertex may
// stand out by more than 5 mm.
double stands_out_m(const models::TriangleMesh& mesh, const std::vector<Vec3>& points) {
  double deepest = 0.0;
  for (std::uint32_t face = 0; face < mesh.size(); ++face) {
    const auto& [a, b, c] = mesh.triangle(face);
    const Vec3 normal = (mesh.vertex(b) - mesh.vertex(a)).cross(mesh.vertex(c) - mesh.vertex(a)).normalized();
    double above = 0.0, below = 0.0;
    for (const Vec3& point : points) {
      const double height = normal.dot(point - mesh.vertex(a));
      above = std::max(above, height);
      below = std::max(below, -height);
    }
    deepest = std::max(deepest, std::min(above, below));
  }
  return deepest;
}

models::ConvexTool read_convex(const YamlNode& node, RigidTool& tool) {
  const std::filesystem::path file = node.existing_file("file");
  const auto mesh = load_mesh(file, {.scale = node.number_or("scale_m", 1.0, between(1e-6, 1e6))}).mesh;
  const bool hull = node.boolean_or("hull", false);
  std::vector<std::uint32_t> used;
  for (std::uint32_t face = 0; face < mesh->size(); ++face) {
    const auto& corners = mesh->triangle(face);
    used.insert(used.end(), corners.begin(), corners.end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  if (used.size() > most_vertices) {
    throw node.error_at("file", "at most " + std::to_string(most_vertices) + " vertices",
                        std::to_string(used.size()) + " vertices in " + file.string(), "simplify the mesh");
  }
  models::ConvexTool convex;
  double size_m = 0.0;
  for (const std::uint32_t vertex : used) {
    convex.points_m.push_back(mesh->vertex(vertex));
    size_m = std::max(size_m, convex.points_m.back().norm());
  }
  // Coordinates in files are rounded to 6e-8 of their size. This turns the plane of a slim triangle by some hundred
  // times that angle.
  constexpr double roundness = 1e-5;
  if (!hull && stands_out_m(*mesh, convex.points_m) > roundness * size_m) {
    const double dent_m = deepest_dent_m(*mesh, models::solid_of(convex, models::Pose::Identity()));
    throw node.error_at("file", "a convex mesh",
                        file.string() + ", which has dents of up to " + description::rounded_text(1e3 * dent_m) + " mm",
                        "`hull: true` takes its convex hull, and `mesh:` instead of `convex:` takes it as it is");
  }
  tool.meshes.push_back(file);
  return convex;
}

models::MeshTool read_mesh(const YamlNode& node, RigidTool& tool) {
  const std::filesystem::path file = node.existing_file("file");
  MeshPlacement placement;
  placement.scale = node.number_or("scale_m", 1.0, between(1e-6, 1e6));
  if (node.has("weld_m")) placement.weld_m = node.number("weld_m", weld_range);
  placement.close_holes_m = node.number_or("close_holes_m", 0.0, between(0.0, 1e3));
  const auto [mesh, account] = load_mesh(file, placement);
  if (const models::NoInside found = models::why_no_inside(*mesh, account.closing); !found.what.empty()) {
    throw node.error_at("file", "a closed mesh, which has an inside", file.string() + ", which " + found.what,
                        found.advice);
  }
  if (mesh->size() > most_triangles) {
    throw node.error_at("file", "at most " + std::to_string(most_triangles) + " triangles",
                        std::to_string(mesh->size()) + " triangles in " + file.string(), "simplify the mesh");
  }
  tool.meshes.push_back(file);
  return {mesh->structure().vertices, mesh->structure().triangles};
}

models::ToolPart read_part(const std::string& kind, const YamlNode& node, RigidTool& tool) {
  models::ToolPart part;
  const auto length = [&](const char* key) { return node.number(key, size_range); };
  if (kind == "sphere") part.shape = models::SphereTool{length("radius_m")};
  if (kind == "capsule") part.shape = models::CapsuleTool{length("length_m"), length("radius_m")};
  if (kind == "cylinder") part.shape = models::CylinderTool{length("length_m"), length("radius_m")};
  if (kind == "box") part.shape = models::BoxTool{vector_of(node.vec3("size_m", size_range))};
  if (kind == "convex") part.shape = read_convex(node, tool);
  if (kind == "mesh") part.shape = read_mesh(node, tool);
  part.X_TP = pose_of(node);
  if (node.has("friction")) part.friction = node.number("friction", friction_range);
  return part;
}

void read_parts(const YamlNode& node, RigidTool& tool) {
  const std::vector<std::string>& kinds = tool_kinds();
  std::vector<std::string> keys = kinds;
  keys.emplace_back("parts");
  if (std::none_of(keys.begin(), keys.end(), [&](const std::string& k) { return node.has(k); })) node.finish();
  const std::string key =
      description::exactly_one(node, keys, "a tool's shape: " + description::one_of(kinds) + "; several under parts");
  if (key != "parts") {
    tool.shape.parts.push_back(read_part(key, node.map(key), tool));
    return;
  }
  for (const YamlNode& entry : node.list("parts", 1, most_parts)) {
    const auto [kind, shape] = description::one_entry(entry, kinds, "a tool's shape", "sphere: {radius_m: 0.01}");
    tool.shape.parts.push_back(read_part(kind, shape, tool));
  }
}

}  // namespace

const std::vector<std::string>& tool_kinds() {
  static const std::vector<std::string> kinds{"sphere", "capsule", "box", "cylinder", "convex", "mesh"};
  return kinds;
}

RigidTool read_tool(const YamlNode& node) {
  RigidTool tool;
  tool.file = node.file();
  tool.line = node.line();
  tool.name = node.string_or("name", tool.file.stem().string());
  read_parts(node, tool);
  return tool;
}

RigidTool load_tool(const std::filesystem::path& file) {
  const YamlNode root = YamlNode::load(file);
  RigidTool tool = read_tool(root);
  root.finish();
  return tool;
}

}  // namespace proxarm::scenes
