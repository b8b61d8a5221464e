#include "scenes/compiler/compile.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_surface.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/lower_dimensional.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "models/world/guides.hpp"
#include "models/world/media.hpp"
#include "models/world/world.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/compiler/section.hpp"

namespace proxarm::scenes {
namespace {

using description::number_text;
using models::Vec;
using models::Vec3;

template <int N>
using Algorithm = CompiledScene::Algorithm<N>;

bool has_friction(const Object& object) {
  return object.friction > 0.0 || std::any_of(object.friction_regions.begin(), object.friction_regions.end(),
                                              [](const FrictionRegion& region) { return region.friction > 0.0; });
}

// A plane of W cut by the proxy's space: a half-space of fewer dimensions.
template <int N>
struct HalfSpace {
  const Object* object = nullptr;
  std::int32_t index = 0;    // of the object in the scene
  std::int32_t feature = 0;  // of the object
  Vec<N> point = Vec<N>::Zero();
  Vec<N> normal = Vec<N>::Zero();
};

// A sphere cut by the space: one of fewer dimensions.
struct Ball {
  const Object* object = nullptr;
  std::int32_t index = 0;
  Vec3 centre = Vec3::Zero();  // in coordinates of the space, then zeros
  double radius_m = 0.0;
  bool inside_out = false;
};

// All that the proxy's space has of a scene, sorted by what it takes to render it.
template <int N>
struct Cut {
  std::vector<HalfSpace<N>> planes;  // flat, rigid and still, faces of boxes from inside among them
  std::vector<Ball> balls;           // with N < 3 only
  std::vector<std::pair<const Object*, std::int32_t>> solids;  // with N < 3 only: see section_of()
  std::vector<std::pair<const Object*, std::int32_t>> others;
};

template <int N>
void cut_plane(const Scene& scene, const Object& object, std::int32_t index, std::int32_t feature,
               const PlaneShape& plane, Cut<N>& cut, CompiledScene& out) {
  if constexpr (N == 3) {
    cut.planes.push_back({&object, index, feature, plane.point_m, plane.normal});
  } else if (const auto in_space = plane_in_space(scene, object, plane)) {
    cut.planes.push_back(
        {&object, index, feature, in_space->point_m.template head<N>(), in_space->normal.template head<N>()});
  } else {
    out.skipped.push_back({object.name, "doesn't meet the proxy's space"});
  }
}

template <int N>
void cut_sphere(const Scene& scene, const Object& object, std::int32_t index, const SphereShape& sphere, Cut<N>& cut,
                CompiledScene& out) {
  const auto A = scene.space.axes.leftCols<N>();
  const Vec<N> near = A.transpose() * (sphere.centre_m - scene.space.origin_m);
  const double away = (scene.space.origin_m + A * near - sphere.centre_m).norm();
  if (!(away < sphere.radius_m)) {
    if (sphere.inside_out) {
      throw refusal(scene, object.line, "the proxy's space lies inside the object " + object.name,
                    "move `space` or the object");
    }
    out.skipped.push_back({object.name, "doesn't meet the proxy's space"});
    return;
  }
  cut.balls.push_back({&object, index, models::lift<N>(near),
                       std::sqrt((sphere.radius_m - away) * (sphere.radius_m + away)), sphere.inside_out});
}

template <int N>
Cut<N> cut_scene(const Scene& scene, CompiledScene& out) {
  Cut<N> cut;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const auto index = static_cast<std::int32_t>(i);
    const bool plain = !object.layer && !object.motion;
    if (const auto* plane = std::get_if<PlaneShape>(&object.shape); plane != nullptr && plain) {
      cut_plane<N>(scene, object, index, 0, *plane, cut, out);
      continue;
    }
    if (const auto* box = std::get_if<BoxShape>(&object.shape); box != nullptr && plain && box->inside_out) {
      std::int32_t feature = 0;
      for (const auto& face : models::BoxObstacle::faces(box->pose_W, box->size_m)) {
        cut_plane<N>(scene, object, index, feature++, {face.point(), Vec3(-face.normal())}, cut, out);
      }
      continue;
    }
    if constexpr (N < 3) {
      const auto* sphere = std::get_if<SphereShape>(&object.shape);
      if (sphere != nullptr && plain) {
        cut_sphere<N>(scene, object, index, *sphere, cut, out);
      } else {
        cut.solids.emplace_back(&object, index);
      }
    } else {
      cut.others.emplace_back(&object, index);
    }
  }
  return cut;
}

template <int N>
Algorithm<N> one_plane(const HalfSpace<N>& plane, CompiledScene& out) {
  const Object& object = *plane.object;
  out.skipped.push_back({"composition", "a single surface"});
  if (object.friction > 0.0 && N > 1) {
    out.stages.push_back({"wall with friction, equation (4)", object.name + ", μ = " + number_text(object.friction)});
    auto wall = std::make_unique<models::FrictionPlane<N>>(plane.point, plane.normal, object.friction);
    out.friction_setters.emplace_back(plane.index, [surface = wall.get()](double mu) { surface->set_friction(mu); });
    return wall;
  }
  out.stages.push_back({"wall, equation (2)", object.name});
  out.skipped.push_back({"friction", object.friction > 0.0 ? "a line has no tangent to slip along" : "μ = 0"});
  return std::make_unique<models::Plane<N>>(plane.point, plane.normal);
}

template <int N>
Algorithm<N> in_space(std::unique_ptr<models::GeometricAlgorithm<3>> space) {
  if constexpr (N == 3) {
    return space;
  } else {
    return std::make_unique<models::LowerDimensional<N>>(std::move(space));
  }
}

template <int N>
Algorithm<N> several_planes(const Cut<N>& cut, CompiledScene& out) {
  std::vector<models::Face> faces;
  bool friction = false;
  for (const auto& plane : cut.planes) {
    const double mu = N > 1 ? plane.object->friction : 0.0;
    friction = friction || mu > 0.0;
    faces.push_back({models::FlatSurface<3>(models::lift<N>(plane.point), models::lift<N>(plane.normal)), mu,
                     plane.index, plane.feature});
  }
  out.stages.push_back(
      {"composition of " + std::to_string(faces.size()) + " planes" + (friction ? " with friction" : ""),
       "sets of at most three contacts, solved directly"});
  if (!friction) out.skipped.push_back({"friction", "μ = 0 everywhere"});
  out.skipped.push_back({"search", "all surfaces are flat and few"});
  auto composition = std::make_unique<models::PlaneComposition>(std::move(faces));
  if (N > 1) {
    std::int32_t last = -1;
    for (const auto& plane : cut.planes) {
      if (std::exchange(last, plane.index) == plane.index) continue;  // once for an object
      out.friction_setters.emplace_back(plane.index, [planes = composition.get(), object = plane.index](double mu) {
        planes->set_friction(object, mu);
      });
    }
  }
  return in_space<N>(std::move(composition));
}

std::unique_ptr<models::Obstacle> moved(std::unique_ptr<models::Obstacle> still, const Object& object,
                                        const Scene& scene, std::int32_t index, CompiledScene& out) {
  if (!object.motion) return still;
  if (!object.motion->driven) {
    return std::make_unique<models::MovingObstacle>(std::move(still), script_in_space(scene, object));
  }
  auto driven = std::make_unique<models::MovingObstacle>(std::move(still), models::Pose::Identity());
  out.driven.emplace_back(index, driven.get());
  return driven;
}

// What a guide on a plane is among objects: the half-spaces on both its sides, in contacts as one more object.
void add_plane_guide(const Scene& scene, std::vector<models::World::Entry>& entries) {
  const GuideDescription& guide = *scene.guide;
  for (const double side : {1.0, -1.0}) {
    auto half =
        std::make_unique<models::PlaneObstacle>(guide.points_m.front(), Vec3(side * guide.direction), guide.friction);
    half->set_slack(8.0);  // a point of the one mustn't be behind the other for its rounding
    entries.push_back({std::move(half), static_cast<std::int32_t>(scene.objects.size()), side > 0.0 ? 0 : 1});
  }
}

template <int N>
std::vector<models::World::Entry> surfaces(const Scene& scene, const Cut<N>& cut, CompiledScene& out) {
  std::vector<models::World::Entry> entries;
  std::size_t moving = 0, layers = 0, with_friction = 0;
  for (const auto& plane : cut.planes) {
    const double mu = N > 1 ? plane.object->friction : 0.0;
    entries.push_back(
        {std::make_unique<models::PlaneObstacle>(models::lift<N>(plane.point), models::lift<N>(plane.normal), mu),
         plane.index, plane.feature});
  }
  for (const Ball& ball : cut.balls) {
    const double mu = N > 1 ? ball.object->friction : 0.0;
    entries.push_back(
        {std::make_unique<models::Sphere>(models::PointCore{ball.centre}, ball.radius_m, mu, ball.inside_out),
         ball.index, 0});
  }
  for (const auto& [object, index] : cut.solids) {
    std::vector<Part> parts = section_of(scene, *object);
    if (parts.empty()) out.skipped.push_back({object->name, "doesn't meet the proxy's space"});
    for (Part& part : parts) {
      entries.push_back({moved(std::move(part.obstacle), *object, scene, index, out), index, part.feature});
    }
    layers += object->layer ? 1 : 0;
  }
  for (const auto& [object, index] : cut.others) {
    for (Part& part : parts_of(scene, *object)) {
      entries.push_back({moved(std::move(part.obstacle), *object, scene, index, out), index, part.feature});
    }
    layers += object->layer ? 1 : 0;
  }
  for (const Object& object : scene.objects) {
    moving += object.motion ? 1 : 0;
    with_friction += has_friction(object) ? 1 : 0;
  }
  if (layers > 0 && scene.guide) {
    throw refusal(scene, scene.guide->line_number, "found an elastic layer beside a guide",
                  "no layer there: on a line an object only says how far the proxy may go, and between two planes back "
                  "to back the force isn't shared out in one way only");
  }
  if (scene.guide && scene.guide->kind == GuideDescription::Kind::plane) {
    add_plane_guide(scene, entries);
    with_friction += scene.guide->friction > 0.0 ? 1 : 0;
  }
  const bool many = entries.size() > 1;
  out.stages.push_back({"clearance", moving > 0 ? "of no use here: something moves"
                                                : "a step that can't reach anything is q = p, without a look"});
  if (many)
    out.stages.push_back({"search among " + std::to_string(entries.size()) + " surfaces", "by a tree of boxes"});
  out.stages.push_back({std::string("contact") + (with_friction > 0 ? " with friction" : ""),
                        "each surface alone, exactly" + std::string(many ? "; then pairs and triples" : "")});
  if (layers > 0) {
    out.stages.push_back(
        {std::to_string(layers) + (layers > 1 ? " elastic layers" : " elastic layer"),
         many ? "alone exactly; with others the force is shared, by Newton's method" : scene.objects.front().name});
  }
  if (moving > 0) {
    out.stages.push_back({"motion", std::to_string(moving) + (moving > 1 ? " objects" : " object") +
                                        "; q is carried along, and met in the object's frame"});
  }
  if (!many) out.skipped.push_back({"composition", "a single surface"});
  if (with_friction == 0) out.skipped.push_back({"friction", "μ = 0 everywhere"});
  if (moving == 0) out.skipped.push_back({"motion", "nothing moves"});
  if (layers == 0) out.skipped.push_back({"elastic layers", "none"});
  for (const models::World::Entry& entry : entries) {
    // A guide's friction and that by triangle stay as the scene has them.
    if (N == 1 || static_cast<std::size_t>(entry.object) >= scene.objects.size() ||
        !scene.objects[static_cast<std::size_t>(entry.object)].friction_regions.empty())
      continue;
    out.friction_setters.emplace_back(entry.object,
                                      [obstacle = entry.obstacle.get()](double mu) { obstacle->set_friction(mu); });
  }
  return entries;
}

template <int N>
std::unique_ptr<models::World> world(const Scene& scene, const Cut<N>& cut, CompiledScene& out) {
  return std::make_unique<models::World>(surfaces<N>(scene, cut, out));
}

// A mesh's sides hold from both of them, and must outlast its motion: a stop on a line is nearer to it than that
// allows.
void require_no_moving_mesh(const Scene& scene) {
  for (const Object& object : scene.objects) {
    if (!object.motion || !std::holds_alternative<MeshShape>(object.shape)) continue;
    throw refusal(scene, object.line, "found " + object.name + ", a mesh that moves, beside a guide along a line",
                  "let it stand still, use another kind of object there, or use a guide on a plane");
  }
}

template <int N>
Algorithm<3> guide_among_objects(const Scene& scene, const GuideDescription& guide, CompiledScene& out) {
  const auto index = static_cast<std::int32_t>(scene.objects.size());
  if (guide.kind == GuideDescription::Kind::plane) {
    out.stages.push_back({"guide on a plane", "two half-spaces back to back, among the objects"});
    return world<N>(scene, cut_scene<N>(scene, out), out);
  }
  require_no_moving_mesh(scene);
  CompiledScene objects;  // whose friction doesn't matter: there is one way to go
  std::vector<models::World::Entry> all = surfaces<N>(scene, cut_scene<N>(scene, objects), objects), still, movers;
  for (models::World::Entry& entry : all) {
    if (entry.obstacle->moves()) entry.obstacle->set_friction(0.0);
    (entry.obstacle->moves() ? movers : still).push_back(std::move(entry));
  }
  out.driven = objects.driven;
  models::PolylineGuide along =
      guide.kind == GuideDescription::Kind::line
          ? models::PolylineGuide::line(guide.points_m.front(), guide.direction, guide.friction)
          : models::PolylineGuide(guide.points_m, guide.closed, guide.friction);
  along.stop_at(std::make_shared<models::World>(std::move(still)), index);
  const std::size_t pushing = movers.size();
  if (pushing > 0) along.be_pushed_by(std::move(movers));
  out.stages.push_back({guide.kind == GuideDescription::Kind::line
                            ? "guide on a line"
                            : "guide along " + std::to_string(guide.points_m.size()) + " points",
                        guide.friction > 0.0 ? "μ = " + number_text(guide.friction) : "without friction"});
  out.stages.push_back({"stop", "at the first of " + std::to_string(scene.objects.size()) +
                                    (scene.objects.size() > 1 ? " objects" : " object") + " on the way"});
  if (pushing > 0) out.stages.push_back({"push", "by what moves onto the proxy, to the next free point"});
  out.skipped.push_back({"friction of objects", "there is one way to go, and what stops it holds"});
  return std::make_unique<models::PolylineGuide>(std::move(along));
}

template <int N>
Algorithm<3> guide(const Scene& scene, const GuideDescription& guide, CompiledScene& out) {
  if (!scene.objects.empty()) return guide_among_objects<N>(scene, guide, out);
  out.skipped.push_back({"contacts", "no objects"});
  if (!(guide.friction > 0.0)) out.skipped.push_back({"friction", "μ = 0"});
  switch (guide.kind) {
    case GuideDescription::Kind::plane:
      out.stages.push_back({"guide", "on a plane, from both sides"});
      return std::make_unique<models::PlaneGuide>(guide.points_m.front(), guide.direction, guide.friction);
    case GuideDescription::Kind::polyline:
      out.stages.push_back({"guide", "along " + std::to_string(guide.points_m.size()) + " points"});
      return std::make_unique<models::PolylineGuide>(guide.points_m, guide.closed, guide.friction);
    case GuideDescription::Kind::line:
      break;
  }
  out.stages.push_back({"guide", "on a line"});
  return std::make_unique<models::PolylineGuide>(
      models::PolylineGuide::line(guide.points_m.front(), guide.direction, guide.friction));
}

// A mesh that is all there is, without a world around it.
Algorithm<3> one_mesh(const Scene& scene, const Object& object, const MeshShape& shape, CompiledScene& out) {
  const models::TriangleMesh& mesh = *shape.mesh;
  out.stages.push_back({"clearance", "a step that can't reach anything is q = p, without a look"});
  out.stages.push_back(
      {"faces near the proxy", "of " + std::to_string(mesh.size()) + ", by a tree of boxes, once in many steps"});
  out.stages.push_back(
      {"mesh" + std::string(object.friction > 0.0 ? " with friction, μ = " + number_text(object.friction) : ""),
       object.name + (mesh.closed() ? ", closed" : ", open: both sides hold")});
  if (mesh.dropped_triangles() > 0) {
    out.skipped.push_back({std::to_string(mesh.dropped_triangles()) + " triangles", "without an area"});
  }
  if (!object.friction_regions.empty()) {
    out.stages.push_back({"friction by triangle", std::to_string(object.friction_regions.size()) + " regions"});
  }
  out.skipped.push_back({"composition", "a single object"});
  if (!has_friction(object)) out.skipped.push_back({"friction", "μ = 0"});
  out.skipped.push_back({"motion", "nothing moves"});
  auto surface = std::make_unique<models::MeshSurface>(shape.mesh, object.friction, friction_by_face(scene, object));
  if (object.friction_regions.empty()) {
    out.friction_setters.emplace_back(0, [mesh_surface = surface.get()](double mu) { mesh_surface->set_friction(mu); });
  }
  return surface;
}

template <int N>
Algorithm<N> contacts(const Scene& scene, CompiledScene& out) {
  if (scene.guide) return in_space<N>(guide<N>(scene, guide_in_space(scene), out));
  const Cut<N> cut = cut_scene<N>(scene, out);
  if (cut.balls.empty() && cut.solids.empty() && cut.others.empty()) {
    if (cut.planes.empty()) {
      out.skipped.push_back({"contacts", "nothing to touch"});
      return nullptr;
    }
    out.skipped.push_back({"motion", "nothing moves"});
    if (cut.planes.size() == 1) return one_plane<N>(cut.planes.front(), out);
    // Flat surfaces have no bounds that a tree could use; looking at each is as good, and this many are few.
    if (cut.planes.size() <= 64) return several_planes<N>(cut, out);
  }
  if constexpr (N == 3) {
    if (cut.planes.empty() && cut.others.size() == 1 && cut.others.front().second == 0) {
      const Object& object = *cut.others.front().first;
      const auto* mesh = std::get_if<MeshShape>(&object.shape);
      if (mesh != nullptr && !object.motion && !object.layer) return one_mesh(scene, object, *mesh, out);
    }
  }
  return in_space<N>(world<N>(scene, cut, out));
}

template <int N>
Algorithm<N> build(const Scene& scene, CompiledScene& out) {
  Algorithm<N> g = contacts<N>(scene, out);
  std::vector<models::Medium> media;
  for (const MediumDescription& medium : scene.media) {
    media.push_back({medium.damping_Ns_per_m, medium.force_N, medium.within ? region_of(*medium.within) : nullptr});
    out.stages.push_back({medium.force_N > 0.0 ? "Coulomb medium" : "viscous medium",
                          medium.within ? "within a " + kind_of(*medium.within) : "everywhere"});
  }
  if (scene.coulomb_force_N) {
    if (!g && media.empty()) {
      out.stages.push_back({"Coulomb field, equation (3)", number_text(*scene.coulomb_force_N) + " N everywhere"});
      return std::make_unique<models::CoulombField<N>>(*scene.coulomb_force_N);
    }
    media.push_back({0.0, *scene.coulomb_force_N, nullptr});
    out.stages.push_back({"Coulomb field", number_text(*scene.coulomb_force_N) + " N everywhere, over the rest"});
  }
  if (!g) {
    out.stages.push_back({"free space, q = p", "nothing to touch"});
    g = std::make_unique<models::FreeSpace<N>>();
  }
  if (media.empty()) {
    out.skipped.push_back({"media", "none"});
    return g;
  }
  models::Pose X_WS = models::Pose::Identity();
  X_WS.linear() = scene.space.axes;
  X_WS.translation() = scene.space.origin_m;
  return std::make_unique<models::Media<N>>(std::move(g), std::move(media), models::Media<N>::first_period_s, X_WS);
}

}  // namespace

CompiledScene compile(const Scene& scene) {
  CompiledScene out;
  out.name = scene.name;
  // Three dimensions are all of W, in its own coordinates.
  if (scene.space.dimensions < 3) out.space = scene.space;
  for (const Object& object : scene.objects) out.frictions.push_back(object.friction);
  switch (scene.space.dimensions) {
    case 1:
      out.any_algorithm = build<1>(scene, out);
      break;
    case 2:
      out.any_algorithm = build<2>(scene, out);
      break;
    default:
      out.any_algorithm = build<3>(scene, out);
      break;
  }
  return out;
}

void CompiledScene::drive(std::size_t object, const models::Pose& X) noexcept {
  const models::Pose X_S = pose_in_space(space, X);
  for (const auto& [index, part] : driven) {
    if (static_cast<std::size_t>(index) == object) part->drive(X_S);
  }
}

void CompiledScene::set_friction(std::size_t object, double friction) noexcept {
  for (const auto& [index, set] : friction_setters) {
    if (static_cast<std::size_t>(index) == object) set(friction);
  }
}

bool CompiledScene::has_friction(std::size_t object) const noexcept {
  return std::any_of(friction_setters.begin(), friction_setters.end(),
                     [object](const auto& part) { return static_cast<std::size_t>(part.first) == object; });
}

double clearance_m(const Scene& scene, const Vec3& x_W) {
  double least = std::numeric_limits<double>::infinity();
  for (const Object& object : scene.objects) least = std::min(least, distance_to(object, x_W));
  return least;
}

double clearance_m(const Scene& scene, const Vec3& x_W, double time_s, Driven driven) {
  double least = std::numeric_limits<double>::infinity();
  for (const Object& object : scene.objects) {
    if (object.motion && object.motion->driven && driven == Driven::left_out) continue;
    const bool moves = object.motion && !object.motion->driven;
    const Vec3 x = moves ? script_of(*object.motion).at(time_s).inverse(Eigen::Isometry) * x_W : x_W;
    least = std::min(least, distance_to(object, x));
  }
  return least;
}

}  // namespace proxarm::scenes
