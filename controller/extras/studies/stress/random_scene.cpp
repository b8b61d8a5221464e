#include "controller/extras/studies/stress/random_scene.hpp"

#include <array>
#include <numbers>

#include "controller/extras/studies/stress/globe_mesh.hpp"

namespace proxarm::studies {
namespace {

using models::Pose;
using models::Vec3;
using scenes::Object;
using scenes::Scene;
using scenes::Shape;

constexpr double pi = std::numbers::pi;

double some_friction(Random& random) { return random.chance(0.3) ? 0.0 : random.uniform(0.0, 1.2); }

Pose some_pose(Random& random, const Vec3& at) {
  Pose pose = Pose::Identity();
  const double angle = random.uniform(-pi, pi);
  pose.linear() = Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
  pose.translation() = at;
  return pose;
}

Shape some_plane(Random& random) {
  const Vec3 normal = random.direction();
  return scenes::PlaneShape{-random.uniform(0.05, 0.5) * normal, normal};
}

Shape some_round(Random& random, const Vec3& at, bool inside_out) {
  const double radius = inside_out ? random.uniform(0.3, 1.0) : random.log_uniform(0.01, 0.3);
  if (random.chance(0.5)) return scenes::SphereShape{at, radius, inside_out};
  const Vec3 half = random.arrow(0.05, 0.4);
  return scenes::CapsuleShape{at - half, at + half, radius, inside_out};
}

Shape some_edged(Random& random, const Vec3& at, bool inside_out) {
  const double low = inside_out ? 0.5 : 0.05, high = inside_out ? 1.5 : 0.5;
  if (random.chance(0.6)) {
    const double x = random.uniform(low, high), y = random.uniform(low, high), z = random.uniform(low, high);
    return scenes::BoxShape{some_pose(random, at), Vec3(x, y, z), inside_out};
  }
  const Vec3 half = random.arrow(0.5 * low, 0.5 * high);
  return scenes::CylinderShape{at - half, at + half, 0.5 * random.uniform(low, high), inside_out};
}

Shape some_mesh(Random& random) {
  const auto rings = static_cast<std::uint32_t>(2 + random.below(4)),
             sectors = static_cast<std::uint32_t>(3 + random.below(8));
  const Pose pose = some_pose(random, random.in_box(0.3));
  const Vec3 half = Vec3::Constant(0.25) + random.in_box(0.15);
  return globe_mesh(rings, sectors, [&](const Vec3& x) { return Vec3(pose * Vec3(half.cwiseProduct(x))); });
}

// Returns a globe with dents that is star-shaped about its middle.
Shape some_concave_mesh(Random& random) {
  const auto rings = static_cast<std::uint32_t>(3 + random.below(5)),
             sectors = static_cast<std::uint32_t>(4 + random.below(8));
  const Pose pose = some_pose(random, random.in_box(0.3));
  const Vec3 half = Vec3::Constant(0.25) + random.in_box(0.1);
  const double deepest = random.uniform(0.05, 0.6);
  return globe_mesh(rings, sectors, [&](const Vec3& x) {
    const double share = 1.0 - random.uniform(0.0, deepest);
    return Vec3(pose * Vec3(share * half.cwiseProduct(x)));
  });
}

scenes::Motion some_motion(Random& random) {
  scenes::Motion motion;
  if (random.chance(0.4)) motion.velocity_m_per_s = random.log_arrow(0.01, 2.0);
  if (random.chance(0.5)) {
    motion.amplitude_m = random.log_arrow(1e-4, 0.2);
    motion.frequency_Hz = random.log_uniform(0.1, 10.0);
    motion.phase_rad = random.uniform(-pi, pi);
  }
  if (random.chance(0.4)) {
    motion.axis = random.direction();
    motion.centre_m = random.in_box(0.3);
    motion.turn_rad_per_s = random.uniform(-6.0, 6.0);
  }
  return motion;
}

Object object(Random& random, Shape shape) {
  Object made;
  made.shape = std::move(shape);
  made.friction = some_friction(random);
  return made;
}

Object any_object(Random& random) {
  const double which = random.uniform(0.0, 1.0);
  if (which < 0.35) return object(random, some_plane(random));
  const bool inside_out = random.chance(0.15);
  const Vec3 at = random.in_box(inside_out ? 0.1 : 0.5);
  return object(random, which < 0.7 ? some_round(random, at, inside_out) : some_edged(random, at, inside_out));
}

void add_media(Random& random, Scene& scene) {
  if (random.chance(0.4)) scene.coulomb_force_N = random.log_uniform(1e-3, 100.0);
  const int media = scene.coulomb_force_N ? random.below(2) : 1 + random.below(2);
  for (int i = 0; i < media; ++i) {
    scenes::MediumDescription medium;
    if (random.chance(0.7)) {
      medium.damping_Ns_per_m = random.log_uniform(0.01, 1e4);
    } else {
      medium.force_N = random.log_uniform(1e-3, 100.0);
    }
    if (random.chance(0.5)) medium.within = scenes::SphereShape{random.in_box(0.5), random.uniform(0.1, 0.6), false};
    scene.media.push_back(medium);
  }
}

void add_guide(Random& random, Scene& scene) {
  scenes::GuideDescription guide;
  guide.kind = std::array{scenes::GuideDescription::Kind::line, scenes::GuideDescription::Kind::plane,
                          scenes::GuideDescription::Kind::polyline}[static_cast<std::size_t>(random.below(3))];
  guide.friction = some_friction(random);
  guide.direction = random.direction();
  const int points = guide.kind == scenes::GuideDescription::Kind::polyline ? 2 + random.below(5) : 1;
  for (int i = 0; i < points; ++i) guide.points_m.push_back(random.in_box(0.5));
  guide.closed = points > 2 && random.chance(0.5);
  scene.guide = guide;
}

void name_objects(Scene& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) scene.objects[i].name = "object " + std::to_string(i);
}

}  // namespace

RandomScene random_scene(Random& random) {
  RandomScene made;
  Scene& scene = made.scene;
  constexpr std::array<const char*, 9> kinds{"planes", "round", "edged", "several", "moving",
                                             "media",  "layer", "guide", "mesh"};
  const auto which = static_cast<std::size_t>(random.below(static_cast<int>(kinds.size())));
  made.kind = kinds[which];
  const bool inside_out = random.chance(0.4);
  const Vec3 at = random.in_box(0.3);
  switch (which) {
    case 0:
      for (int i = 1 + random.below(5); i > 0; --i) scene.objects.push_back(object(random, some_plane(random)));
      if (random.chance(0.3)) scene.space.dimensions = 1 + random.below(2);
      break;
    case 1:
      scene.objects.push_back(object(random, some_round(random, at, inside_out)));
      break;
    case 2:
      scene.objects.push_back(object(random, some_edged(random, at, inside_out)));
      break;
    case 3:
      for (int i = 2 + random.below(4); i > 0; --i) scene.objects.push_back(any_object(random));
      break;
    case 4:
      for (int i = 1 + random.below(3); i > 0; --i) {
        scene.objects.push_back(any_object(random));
        if (i == 1 || random.chance(0.5)) scene.objects.back().motion = some_motion(random);
      }
      break;
    case 5:
      if (random.chance(0.7)) scene.objects.push_back(any_object(random));
      add_media(random, scene);
      break;
    case 6:
      scene.objects.push_back(
          object(random, random.chance(0.4) ? some_plane(random) : some_round(random, at, inside_out)));
      scene.objects.back().layer = scenes::ElasticLayer{random.log_uniform(1e-4, 5e-3), random.log_uniform(100.0, 1e5)};
      break;
    case 7:
      add_guide(random, scene);
      break;
    default:
      scene.objects.push_back(object(random, some_mesh(random)));
      if (random.chance(0.3)) scene.objects.push_back(object(random, some_plane(random)));
      break;
  }
  name_objects(scene);
  return made;
}

RandomScene random_mesh_scene(Random& random) {
  RandomScene made;
  Scene& scene = made.scene;
  const bool moves = random.chance(0.5), concave = !moves || random.chance(0.5);
  made.kind = moves ? "moving_mesh" : "concave_mesh";
  scene.objects.push_back(object(random, concave ? some_concave_mesh(random) : some_mesh(random)));
  if (moves) scene.objects.back().motion = some_motion(random);
  if (random.chance(0.5)) {
    const double which = random.uniform(0.0, 1.0);
    scene.objects.push_back(object(random, which < 0.5   ? some_plane(random)
                                           : which < 0.8 ? some_round(random, random.in_box(0.5), false)
                                                         : some_concave_mesh(random)));
    if (moves && random.chance(0.5)) scene.objects.back().motion = some_motion(random);
  }
  name_objects(scene);
  return made;
}

RandomScene random_layer_scene(Random& random) {
  RandomScene made;
  Scene& scene = made.scene;
  const bool moves = random.chance(0.3);
  made.kind = moves ? "moving_layers" : "layers";
  for (int i = 2 + random.below(4); i > 0; --i) {
    scene.objects.push_back(any_object(random));
    Object& object = scene.objects.back();
    // Layers are at most 9 mm thick, because the thinnest object is 20 mm thick.
    const double thickness = random.log_uniform(1e-4, 9e-3), stiffness = random.log_uniform(100.0, 1e6);
    if (random.chance(0.7)) object.layer = scenes::ElasticLayer{thickness, stiffness};
    if (moves && random.chance(0.5)) object.motion = some_motion(random);
  }
  name_objects(scene);
  return made;
}

}  // namespace proxarm::studies
