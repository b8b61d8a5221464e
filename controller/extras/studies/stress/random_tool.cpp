#include "controller/extras/studies/stress/random_tool.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "controller/extras/studies/stress/globe_mesh.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using models::Pose;
using models::ToolPart;
using models::Vec3;

double some_friction(Random& random) { return random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.8); }

Pose some_pose(Random& random, double half_m) {
  Pose pose = Pose::Identity();
  const double angle = random.uniform(-3.0, 3.0);
  pose.linear() = Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
  pose.translation() = random.in_box(half_m);
  return pose;
}

Vec3 some_size(Random& random, double low, double high) {
  Vec3 size;
  for (double& x : size) x = random.uniform(low, high);
  return size;
}

ToolPart some_part(Random& random) {
  ToolPart part;
  const int kind = random.below(3);
  const double radius = random.uniform(0.003, 0.015), length = random.uniform(0.01, 0.03);
  if (kind == 0) part.shape = models::SphereTool{radius};
  if (kind == 1) part.shape = models::CapsuleTool{length, radius};
  if (kind == 2) part.shape = models::BoxTool{some_size(random, 0.005, 0.03)};
  if (random.chance(0.2)) part.friction = some_friction(random);
  return part;
}

ToolPart some_hull(Random& random) {
  models::ConvexTool hull;
  const int count = 4 + random.below(5);
  for (int i = 0; i < count; ++i) {
    const Vec3 out = random.direction();
    hull.points_m.emplace_back(random.uniform(0.01, 0.03) * out);
  }
  return {hull, Pose::Identity(), {}};
}

scenes::Shape some_solid(Random& random, bool box) {
  const Pose pose = some_pose(random, 0.08);
  const int kind = random.below(3);
  if (box || kind == 0) return scenes::BoxShape{pose, some_size(random, 0.02, 0.1), false};
  const double radius = random.uniform(0.005, 0.05);
  const Vec3 half = random.uniform(0.01, 0.05) * pose.linear().col(2);
  if (kind == 1) return scenes::SphereShape{pose.translation(), radius, false};
  return scenes::CapsuleShape{pose.translation() - half, pose.translation() + half, radius, false};
}

scenes::Shape some_hollow(Random& random) {
  const Pose pose = some_pose(random, 0.01);
  const double radius = random.uniform(0.06, 0.12);
  const Vec3 middle = pose.translation(), half = random.uniform(0.06, 0.1) * pose.linear().col(2);
  switch (random.below(4)) {
    case 0:
      return scenes::BoxShape{pose, some_size(random, 0.12, 0.25), true};
    case 1:
      return scenes::SphereShape{middle, radius, true};
    case 2:
      return scenes::CapsuleShape{middle - half, middle + half, radius, true};
    default:
      return scenes::CylinderShape{middle - half, middle + half, radius, true};
  }
}

// Returns a star-shaped mesh with bumps of some per cent of the radius, or with dents.
scenes::MeshShape some_star(Random& random, const Vec3& middle, double radius, int finest) {
  const bool rough = random.chance(0.5);
  const double high = rough ? 0.04 : random.uniform(0.1, 0.4);
  const Vec3 first = (rough ? 9.0 : 4.0) * random.direction(), second = 7.0 * random.direction();
  const auto rings = static_cast<std::uint32_t>(3 + random.below(finest));
  const auto sectors = static_cast<std::uint32_t>(4 + random.below(finest + 2));
  const models::Mat3 R = some_pose(random, 0.0).linear();
  return globe_mesh(rings, sectors, [&](const Vec3& x) {
    const double bump = high * (std::sin(first.dot(x)) + 0.5 * std::sin(second.dot(x)));
    return Vec3(middle + radius * (1.0 + bump) * (R * x));
  });
}

ToolPart some_mesh_tool(Random& random) {
  const scenes::MeshShape star = some_star(random, Vec3::Zero(), random.uniform(0.008, 0.025), 5);
  ToolPart part;
  part.shape = models::MeshTool{star.mesh->structure().vertices, star.mesh->structure().triangles};
  if (random.chance(0.2)) part.friction = some_friction(random);
  return part;
}

void add(Random& random, scenes::Scene& scene, scenes::Shape shape) {
  scenes::Object object;
  object.shape = std::move(shape);
  object.friction = some_friction(random);
  object.name = "object " + std::to_string(scene.objects.size());
  scene.objects.push_back(std::move(object));
}

scenes::Motion some_motion(Random& random, const scenes::Shape& shape) {
  scenes::Motion motion;
  const double speed = random.log_uniform(1e-3, 0.3);
  motion.frequency_Hz = random.log_uniform(0.3, 8.0);
  motion.amplitude_m = speed / (2.0 * std::numbers::pi * motion.frequency_Hz) * random.direction();
  motion.phase_rad = random.uniform(0.0, 6.0);
  if (random.chance(0.3)) motion.velocity_m_per_s = random.in_box(0.02);
  if (random.chance(0.5)) {
    const auto* plane = std::get_if<scenes::PlaneShape>(&shape);
    motion.turn_rad_per_s = random.log_uniform(1e-2, 3.0);
    motion.centre_m = scenes::middle_of(shape);
    motion.axis = plane != nullptr ? plane->normal : random.direction();
  }
  return motion;
}

}  // namespace

void set_in_motion(Random& random, scenes::Scene& scene) {
  for (scenes::Object& object : scene.objects) {
    if (random.chance(0.75)) object.motion = some_motion(random, object.shape);
  }
}

RandomToolScene random_tool_scene(Random& random) {
  RandomToolScene made;
  constexpr std::array<const char*, 4> kinds{"planes", "solids", "boxes", "hollow"};
  const int which = random.below(4);
  made.kind = kinds[static_cast<std::size_t>(which)];
  const bool convex = which == 2 || (which != 1 && random.chance(0.2));
  made.tool.parts.push_back(convex ? some_hull(random) : some_part(random));
  if (!convex && random.chance(0.3)) {
    made.tool.parts.push_back(some_part(random));
    for (ToolPart& part : made.tool.parts) part.X_TP = some_pose(random, 0.02);
  }
  if (which == 0) {
    for (int i = 1 + random.below(4); i > 0; --i) {
      const Vec3 normal = (random.in_box(1.0) + Vec3::UnitZ()).normalized();
      add(random, made.scene, scenes::PlaneShape{-random.uniform(0.0, 0.03) * normal, normal});
    }
  } else if (which == 3) {
    add(random, made.scene, some_hollow(random));
  } else {
    for (int i = 2 + random.below(5); i > 0; --i) add(random, made.scene, some_solid(random, which == 2));
  }
  return made;
}

RandomToolScene random_mesh_tool_scene(Random& random) {
  RandomToolScene made;
  made.kind = "meshes";
  const int which = random.below(3);
  const bool tool = which > 0, object = which != 1;
  made.tool.parts.push_back(tool ? some_mesh_tool(random) : random.chance(0.3) ? some_hull(random) : some_part(random));
  // The judge (ToolLaws) can't compute the distance between a convex hull and a round object, so these don't occur
  // together.
  const bool sharp = std::holds_alternative<models::ConvexTool>(made.tool.parts.front().shape);
  if (object) {
    const Vec3 middle = random.in_box(0.03);
    add(random, made.scene, some_star(random, middle, random.uniform(0.03, 0.07), 9));
  }
  for (int i = object ? random.below(3) : 1 + random.below(3); i > 0; --i) {
    if (random.chance(0.3)) {
      const Vec3 normal = random.direction();
      add(random, made.scene, scenes::PlaneShape{-random.uniform(0.03, 0.08) * normal, normal});
    } else {
      add(random, made.scene, some_solid(random, sharp));
    }
  }
  return made;
}

}  // namespace proxarm::studies
