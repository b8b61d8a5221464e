#include "scenes/rigid/compile_rigid.hpp"

#include <algorithm>
#include <stdexcept>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_topology.hpp"
#include "models/rigid/rigid_world.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::FlatSide;
using models::Pose;
using models::RigidObject;
using models::Vec3;

bool has_cylinder(const std::vector<models::ToolPart>& parts) {
  return std::any_of(parts.begin(), parts.end(), [](const models::ToolPart& part) {
    return std::holds_alternative<models::CylinderTool>(part.shape);
  });
}

Pose at(const Vec3& place, const Vec3& axis) {
  Pose X = Pose::Identity();
  X.linear() = models::rotation_from_z(axis).toRotationMatrix();
  X.translation() = place;
  return X;
}

using Shapes = std::vector<decltype(RigidObject::shape)>;

// Returns a flat side of an object that encloses the tool, such as a box seen from inside or a cylinder's end.
FlatSide side(const Vec3& normal, const Vec3& through) { return {normal, normal.dot(through)}; }

// Converts an object's shape to the shapes that a rigid tool can touch. Precondition: why_not_beside() found no reason
// against the object.
struct ShapesOf {
  Shapes operator()(const PlaneShape& s) const { return {side(s.normal.normalized(), s.point_m)}; }
  Shapes operator()(const SphereShape& s) const {
    if (s.inside_out) return {models::HollowSphere{s.centre_m, s.radius_m}};
    return {models::solid_of(models::SphereTool{s.radius_m}, at(s.centre_m, Vec3::UnitZ()))};
  }
  Shapes operator()(const CapsuleShape& s) const {
    if (s.inside_out) return {models::HollowTube{s.from_m, s.to_m, s.radius_m, false}};
    const Vec3 along = s.to_m - s.from_m;
    return {models::solid_of(models::CapsuleTool{along.norm(), s.radius_m}, at(0.5 * (s.from_m + s.to_m), along))};
  }
  Shapes operator()(const BoxShape& s) const {
    if (!s.inside_out) return {models::solid_of(models::BoxTool{s.size_m}, s.pose_W)};
    Shapes sides;
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = s.pose_W.linear().col(k), half = 0.5 * s.size_m[k] * axis;
      sides.emplace_back(side(axis, s.pose_W.translation() - half));
      sides.emplace_back(side(-axis, s.pose_W.translation() + half));
    }
    return sides;
  }
  // From inside, a cylinder consists of an endless tube and of two flat ends.
  Shapes operator()(const CylinderShape& s) const {
    if (!s.inside_out) {
      const Vec3 along = s.to_m - s.from_m;
      return {models::solid_of(models::CylinderTool{along.norm(), s.radius_m}, at(0.5 * (s.from_m + s.to_m), along))};
    }
    const Vec3 axis = (s.to_m - s.from_m).normalized();
    return {models::HollowTube{s.from_m, s.to_m, s.radius_m, true}, side(axis, s.from_m), side(-axis, s.to_m)};
  }
  Shapes operator()(const MeshShape& s) const { return {std::make_shared<const models::TriangleFeatures>(s.mesh)}; }
};

// Returns the shapes of an object. Throws SetupError with the object's line if the faces of its mesh don't make a body.
Shapes shapes_of(const Scene& scene, const Object& object) {
  try {
    return std::visit(ShapesOf{}, object.shape);
  } catch (const std::invalid_argument& problem) {
    throw refusal(
        scene, object.line,
        "a rigid tool needs to know on which side of a mesh it is, and \"" + object.name + "\" has " + problem.what(),
        "");
  }
}

// Returns why the object can't be rendered with a rigid tool; empty if it can. Everything that no test covers yet is
// refused.
std::string why_not_beside(const Object& object, const models::Tool& tool) {
  const std::string name = "\"" + object.name + "\"";
  if (object.layer) return "a rigid tool touches rigid objects only, and " + name + " has a layer";
  if (!object.friction_regions.empty()) {
    return "a rigid tool feels one friction for all of an object, and " + name + " has regions";
  }
  if (const auto* mesh = std::get_if<MeshShape>(&object.shape); mesh != nullptr) {
    const models::NoInside found = models::why_no_inside(*mesh->mesh, mesh->account.closing);
    const std::string advice = found.advice.empty() ? "" : " (" + found.advice + ")";
    const std::string file = mesh->file.empty() ? "" : ", " + mesh->file.string() + ",";
    if (!found.what.empty()) {
      return "a rigid tool is held by closed meshes only, whose faces don't cross, and " + name + file + " " +
             found.what + advice;
    }
  }
  if (!has_cylinder(tool.parts) || !is_inside_out(object.shape)) return {};
  if (std::holds_alternative<CapsuleShape>(object.shape)) {
    return "a cylinder as a tool isn't held by the round ends of a hollow capsule: take a cylinder for " + name;
  }
  return {};
}

}  // namespace

std::optional<Refusal> why_not(const Scene& scene, const models::Tool& tool) {
  if (scene.space.dimensions != 3) return Refusal{"a rigid tool needs a scene of three dimensions"};
  if (!scene.media.empty()) {
    return Refusal{"a medium acts on a point; it isn't rendered for a rigid tool", scene.media.front().line};
  }
  if (scene.coulomb_force_N) {
    return Refusal{"a Coulomb force acts on a point; it isn't rendered for a rigid tool", scene.coulomb_line};
  }
  if (scene.guide) {
    return Refusal{"a guide holds a point; it isn't rendered for a rigid tool", scene.guide->line_number};
  }
  for (const Object& object : scene.objects) {
    if (const std::string why = why_not_beside(object, tool); !why.empty()) return Refusal{why, object.line};
  }
  return {};
}

std::unique_ptr<models::PoseAlgorithm> compile_rigid(const Scene& scene, const models::Tool& tool) {
  if (const std::optional<Refusal> no = why_not(scene, tool)) throw refusal(scene, no->line, no->why, "");
  std::vector<RigidObject> objects;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    for (auto& shape : shapes_of(scene, scene.objects[i])) {
      RigidObject part;
      part.shape = std::move(shape);
      part.friction = scene.objects[i].friction;
      part.object = static_cast<std::int32_t>(i);
      part.inside_out = is_inside_out(scene.objects[i].shape);
      if (const std::optional<Motion>& motion = scene.objects[i].motion) {
        part.motion = models::RigidMotion{script_of(*motion), motion->driven};
      }
      objects.push_back(std::move(part));
    }
  }
  try {
    auto world = std::make_unique<models::RigidWorld>(tool, std::move(objects));
    if (scene.objects.empty()) return std::make_unique<models::FreePose>();
    return world;
  } catch (const std::invalid_argument& problem) {
    const bool named = scene.tool != nullptr;
    throw description::SetupError({.file = named ? scene.tool->file.string() : std::string(),
                                   .line = named ? scene.tool->line : 0,
                                   .key = "tool",
                                   .message = problem.what()});
  }
}

}  // namespace proxarm::scenes
