#include "scenes/compiler/cut.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "models/obstacles/box_obstacle.hpp"
#include "scenes/compiler/seams.hpp"
#include "scenes/compiler/section.hpp"

namespace proxarm::scenes {
namespace {

using models::Vec;
using models::Vec3;

template <int N>
void cut_plane(const Scene& scene, std::int32_t index, std::int32_t feature, const PlaneShape& plane, Cut<N>& cut) {
  if constexpr (N == 3) {
    cut.planes.push_back({index, feature, plane.point_m, plane.normal});
  } else if (const auto in_space = plane_in_space(scene, scene.objects[static_cast<std::size_t>(index)], plane)) {
    cut.planes.push_back({index, feature, in_space->point_m.template head<N>(), in_space->normal.template head<N>()});
  }
}

template <int N>
void cut_sphere(const Scene& scene, std::int32_t index, const SphereShape& sphere, Cut<N>& cut) {
  const auto A = scene.space.axes.leftCols<N>();
  const Vec<N> near = A.transpose() * (sphere.centre_m - scene.space.origin_m);
  const double away = (scene.space.origin_m + A * near - sphere.centre_m).norm();
  if (!(away < sphere.radius_m)) {
    const Object& object = scene.objects[static_cast<std::size_t>(index)];
    if (sphere.inside_out) {
      throw refusal(scene, object.line, "the proxy's space lies inside the object " + object.name,
                    "move `space` or the object");
    }
    return;
  }
  cut.balls.push_back({index, models::lift<N>(near), std::sqrt((sphere.radius_m - away) * (sphere.radius_m + away)),
                       sphere.inside_out});
}

// Adds the object's section to the cut if the object consists of rigid planes at rest or, with N < 3, is a rigid sphere
// at rest. True if it was added.
template <int N>
bool cut_plain(const Scene& scene, std::int32_t index, Cut<N>& cut) {
  const Object& object = scene.objects[static_cast<std::size_t>(index)];
  if (object.layer || object.motion) return false;
  if (const auto* plane = std::get_if<PlaneShape>(&object.shape)) {
    cut_plane<N>(scene, index, 0, *plane, cut);
    return true;
  }
  if (const auto* box = std::get_if<BoxShape>(&object.shape); box != nullptr && box->inside_out) {
    std::int32_t feature = 0;
    for (const auto& face : models::BoxObstacle::faces(box->pose_W, box->size_m)) {
      cut_plane<N>(scene, index, feature++, {face.point(), Vec3(-face.normal())}, cut);
    }
    return true;
  }
  if constexpr (N < 3) {
    if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
      cut_sphere<N>(scene, index, *sphere, cut);
      return true;
    }
  }
  return false;
}

}  // namespace

const MeshShape* lone_mesh(const Scene& scene) {
  if (scene.objects.size() != 1 || scene.guide) return nullptr;
  const Object& object = scene.objects.front();
  return object.motion || object.layer ? nullptr : std::get_if<MeshShape>(&object.shape);
}

template <int N>
Cut<N> cut_by_space(const Scene& scene) {
  Cut<N> cut;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto index = static_cast<std::int32_t>(i);
    const std::size_t before = cut.planes.size() + cut.balls.size();
    if (!cut_plain<N>(scene, index, cut)) {
      cut.solids.push_back({index, {}});
    } else if (cut.planes.size() + cut.balls.size() == before) {
      cut.missed.push_back(index);
    }
  }
  if (N == 3 && lone_mesh(scene) != nullptr) {
    cut.solids.clear();
    return cut;
  }
  const auto parts = [&](const Object& object) { return N == 3 ? parts_of(scene, object) : section_of(scene, object); };
  const Joined joined = join(scene);
  std::vector<Solid*> solid_of(scene.objects.size(), nullptr);
  for (Solid& solid : cut.solids) {
    solid_of[static_cast<std::size_t>(solid.object)] = &solid;
    solid.parts = parts(joined.objects[static_cast<std::size_t>(solid.object)]);
    if (solid.parts.empty()) cut.missed.push_back(solid.object);
  }
  for (const Seam& seam : joined.seams) {
    std::vector<Part> bridges = parts(seam.bridge);
    if (bridges.empty()) continue;
    cut.joined.emplace_back(seam.object, seam.with);
    for (Part& bridge : bridges) solid_of[static_cast<std::size_t>(seam.object)]->parts.push_back(std::move(bridge));
  }
  return cut;
}

template Cut<1> cut_by_space<1>(const Scene&);
template Cut<2> cut_by_space<2>(const Scene&);
template Cut<3> cut_by_space<3>(const Scene&);

}  // namespace proxarm::scenes
