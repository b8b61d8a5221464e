#include "scenes/compiler/rigid.hpp"

#include <algorithm>
#include <stdexcept>

#include "models/base/setup_error.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::FlatSide;
using models::HollowSphere;
using models::HollowTube;
using models::Pose;
using models::RigidObject;
using models::Vec3;

bool has_cylinder(const std::vector<models::ToolPart>& parts) {
  return std::any_of(parts.begin(), parts.end(), [](const models::ToolPart& part) {
    return std::holds_alternative<models::CylinderTool>(part.shape);
  });
}

bool has_edges(const std::vector<models::ToolPart>& parts) {
  return std::any_of(parts.begin(), parts.end(), [](const models::ToolPart& part) {
    return std::holds_alternative<models::BoxTool>(part.shape) ||
           std::holds_alternative<models::ConvexTool>(part.shape);
  });
}

Pose at(const Vec3& place, const Vec3& axis) {
  Pose X = Pose::Identity();
  X.linear() = models::Quaternion::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix();
  X.translation() = place;
  return X;
}

// The shapes of an object: one, unless it is hollow with flat sides.
struct Shapes {
  std::vector<decltype(RigidObject::shape)> operator()(const PlaneShape& s) const {
    const Vec3 n = s.normal.normalized();
    return {FlatSide{n, n.dot(s.point_m)}};
  }
  std::vector<decltype(RigidObject::shape)> operator()(const SphereShape& s) const {
    if (s.inside_out) return {HollowSphere{s.centre_m, s.radius_m}};
    return {models::solid_of(models::SphereTool{s.radius_m}, at(s.centre_m, Vec3::UnitZ()))};
  }
  std::vector<decltype(RigidObject::shape)> operator()(const CapsuleShape& s) const {
    if (s.inside_out) return {HollowTube{s.from_m, s.to_m, s.radius_m, false}};
    const Vec3 along = s.to_m - s.from_m;
    return {models::solid_of(models::CapsuleTool{along.norm(), s.radius_m}, at(0.5 * (s.from_m + s.to_m), along))};
  }
  std::vector<decltype(RigidObject::shape)> operator()(const BoxShape& s) const {
    if (!s.inside_out) return {models::solid_of(models::BoxTool{s.size_m}, s.pose_W)};
    std::vector<decltype(RigidObject::shape)> sides;
    for (const auto& face : models::BoxObstacle::faces(s.pose_W, s.size_m)) {
      const Vec3 inwards = -face.normal();
      sides.emplace_back(FlatSide{inwards, inwards.dot(face.point())});
    }
    return sides;
  }
  std::vector<decltype(RigidObject::shape)> operator()(const CylinderShape& s) const {
    const Vec3 e = (s.to_m - s.from_m).normalized();
    return {HollowTube{s.from_m, s.to_m, s.radius_m, true}, FlatSide{Vec3(-e), -e.dot(s.to_m)},
            FlatSide{e, e.dot(s.from_m)}};
  }
  std::vector<decltype(RigidObject::shape)> operator()(const MeshShape& s) const {
    return {std::make_shared<const models::TriangleFeatures>(s.mesh)};
  }
};

}  // namespace

std::optional<Refusal> why_not(const Scene& scene, const models::Tool& tool) {
  if (scene.space.dimensions != 3) return Refusal{"a rigid tool needs a scene of three dimensions"};
  if (!scene.media.empty() || scene.coulomb_force_N) {
    return Refusal{"a medium and a Coulomb force act on a point; they aren't rendered for a rigid tool",
                   scene.media.empty() ? scene.coulomb_line : scene.media.front().line};
  }
  if (scene.guide)
    return Refusal{"a guide holds a point; it isn't rendered for a rigid tool", scene.guide->line_number};
  for (const Object& object : scene.objects) {
    const std::string name = "\"" + object.name + "\"";
    if (object.layer)
      return Refusal{"a rigid tool touches rigid objects only, and " + name + " has a layer", object.line};
    const bool hollow = std::visit(
        [](const auto& s) {
          if constexpr (requires { s.inside_out; }) return s.inside_out;
          return true;  // a plane
        },
        object.shape);
    const bool is_mesh = std::holds_alternative<MeshShape>(object.shape);
    if (std::holds_alternative<CylinderShape>(object.shape) && !hollow) {
      return Refusal{
          "contact of a rigid tool with the outside of a cylinder isn't built: take a capsule or a mesh for " + name,
          object.line};
    }
    if (is_mesh && has_edges(tool.parts)) {
      return Refusal{"a box or a convex tool isn't held by meshes yet: take a sphere or a capsule beside " + name,
                     object.line};
    }
    if (has_cylinder(tool.parts) && (is_mesh || !hollow)) {
      return Refusal{
          "a cylinder as a tool is held by planes and by hollow objects only: take a convex tool or a capsule "
          "beside " +
              name,
          object.line};
    }
  }
  return {};
}

std::unique_ptr<models::PoseAlgorithm> compile_rigid(const Scene& scene, const models::Tool& tool) {
  if (const std::optional<Refusal> no = why_not(scene, tool)) throw refusal(scene, no->line, no->why, "");
  std::vector<RigidObject> objects;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    for (auto& shape : std::visit(Shapes{}, object.shape)) {
      RigidObject part;
      part.shape = std::move(shape);
      part.friction = object.friction;
      part.friction_of_face = friction_by_face(scene, object);
      part.object = static_cast<std::int32_t>(i);
      if (object.motion && object.motion->driven) {
        part.driven = true;
      } else if (object.motion) {
        part.motion = script_of(*object.motion);
      }
      objects.push_back(std::move(part));
    }
  }
  if (objects.empty()) return std::make_unique<models::FreePose>();
  try {
    return std::make_unique<models::RigidWorld>(tool, std::move(objects));
  } catch (const std::invalid_argument& problem) {
    throw description::SetupError({.key = "tool", .message = problem.what()});
  }
}

}  // namespace proxarm::scenes
