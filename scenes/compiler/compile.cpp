#include "scenes/compiler/compile.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "models/mesh/mesh_surface.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/lower_dimensional.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "models/world/guides.hpp"
#include "models/world/media.hpp"
#include "models/world/world.hpp"
#include "scenes/compiler/cut.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/compiler/section.hpp"

namespace proxarm::scenes {
namespace {

using Kind = GuideDescription::Kind;
using models::Vec;
using models::Vec3;
using Entries = std::vector<models::World::Entry>;

template <int N>
using Algorithm = CompiledScene::Algorithm<N>;
using SpaceAlgorithm = Algorithm<3>;  // lifts a 𝒢 of N dimensions to three

const Object& object_at(const Scene& scene, std::int32_t index) {
  return scene.objects[static_cast<std::size_t>(index)];
}

bool has_friction(const Object& object) {
  return object.friction > 0.0 || std::any_of(object.friction_regions.begin(), object.friction_regions.end(),
                                              [](const FrictionRegion& region) { return region.friction > 0.0; });
}

// ---- Which 𝒢 is built

// Throws SetupError if a mesh moves beside a guide along a line. Both sides of a mesh hold the proxy, so a moving mesh
// must not pass it. A stop on a line comes nearer to the mesh than this requires.
void require_no_moving_mesh(const Scene& scene) {
  for (const Object& object : scene.objects) {
    if (!object.motion || !std::holds_alternative<MeshShape>(object.shape)) continue;
    throw refusal(scene, object.line, "found " + object.name + ", a mesh that moves, beside a guide along a line",
                  "let it stand still, use another kind of object there, or use a guide on a plane");
  }
}

void require_no_layer(const Scene& scene, const Plan& plan) {
  if (plan.layers == 0) return;
  throw refusal(scene, scene.guide->line_number, "found an elastic layer beside a guide",
                "no layer there: on a line an object only says how far the proxy may go, and between two planes back "
                "to back the force isn't shared out in one way only");
}

template <int N>
Plan::Contacts contacts_of(const Scene& scene, const Plan& plan, const Cut<N>& cut) {
  using enum Plan::Contacts;
  if (plan.guide) {
    if (scene.objects.empty()) return guide;
    return plan.guide->kind == Kind::plane ? world : guide_among_objects;
  }
  if (N == 3 && lone_mesh(scene) != nullptr) return mesh;
  if (!cut.balls.empty() || !cut.solids.empty()) return world;
  if (cut.planes.empty()) return none;
  if (cut.planes.size() == 1) {
    return N > 1 && object_at(scene, cut.planes.front().object).friction > 0.0 ? friction_plane : plane;
  }
  // A tree can't help here, because flat surfaces are unbounded. Checking each of up to 64 surfaces is fast.
  return cut.planes.size() <= 64 ? planes : world;
}

// Counts what the plan reports: surfaces, layers, moving objects and friction. Objects that the space doesn't meet
// don't count.
template <int N>
void count(const Scene& scene, const Cut<N>& cut, Plan& plan) {
  bool friction = plan.guide && plan.guide->friction > 0.0;
  const auto meets = [&](std::int32_t index) {
    const Object& object = object_at(scene, index);
    plan.layers += object.layer ? 1 : 0;
    plan.moving += object.motion ? 1 : 0;
    // With a guide along a line, objects have no friction: there is only one direction, and an object in this direction
    // stops the proxy.
    if (plan.contacts != Plan::Contacts::guide_among_objects) friction = friction || has_friction(object);
  };
  // These objects are rigid and at rest, so it doesn't matter that several faces belong to one object.
  for (const auto& plane : cut.planes) meets(plane.object);
  for (const Ball& ball : cut.balls) meets(ball.object);
  for (const Solid& solid : cut.solids) {
    if (!solid.parts.empty()) meets(solid.object);
    plan.surfaces += solid.parts.size();
  }
  plan.surfaces += cut.planes.size() + cut.balls.size();
  if (plan.contacts == Plan::Contacts::mesh) meets(0);
  if (plan.contacts == Plan::Contacts::world && plan.guide) plan.surfaces += 2;  // add_plane_guide() adds two
  if (friction) plan.friction = N > 1 ? Plan::Friction::acts : Plan::Friction::no_tangent;
}

// Returns the object to which all contacts belong; nullopt if there are several.
template <int N>
std::optional<std::int32_t> only_object(const Plan& plan, const Cut<N>& cut) {
  if (plan.contacts == Plan::Contacts::mesh) return 0;
  if (plan.surfaces != 1) return std::nullopt;
  if (!cut.planes.empty()) return cut.planes.front().object;
  if (!cut.balls.empty()) return cut.balls.front().object;
  for (const Solid& solid : cut.solids) {
    if (!solid.parts.empty()) return solid.object;
  }
  return std::nullopt;
}

template <int N>
Plan plan_of(const Scene& scene, std::optional<GuideDescription> guide, const Cut<N>& cut) {
  Plan plan;
  plan.guide = std::move(guide);
  plan.contacts = contacts_of<N>(scene, plan, cut);
  count<N>(scene, cut, plan);
  if (plan.guide) require_no_layer(scene, plan);
  plan.only_object = only_object<N>(plan, cut);
  plan.missed = cut.missed;
  plan.joined = cut.joined;
  if (scene.coulomb_force_N) {
    const bool alone = plan.contacts == Plan::Contacts::none && scene.media.empty();
    plan.coulomb = alone ? Plan::Coulomb::field : Plan::Coulomb::medium;
  }
  return plan;
}

// ---- How it is built

template <int N>
Algorithm<N> in_space(SpaceAlgorithm lifted) {
  if constexpr (N == 3) {
    return lifted;
  } else {
    return std::make_unique<models::LowerDimensional<N>>(std::move(lifted));
  }
}

template <int N>
Algorithm<N> friction_plane(const Scene& scene, const HalfSpace<N>& plane, CompiledScene& out) {
  auto wall =
      std::make_unique<models::FrictionPlane<N>>(plane.point, plane.normal, object_at(scene, plane.object).friction);
  out.friction_setters.emplace_back(plane.object, [surface = wall.get()](double mu) { surface->set_friction(mu); });
  return wall;
}

// Returns the friction of an object in the space. On a line it is 0, because a line has no tangent along which the
// proxy could slip.
template <int N>
double friction_in_space(const Scene& scene, std::int32_t object) {
  return N > 1 ? object_at(scene, object).friction : 0.0;
}

template <int N>
SpaceAlgorithm plane_composition(const Scene& scene, const Cut<N>& cut, CompiledScene& out) {
  std::vector<models::Face> faces;
  for (const auto& plane : cut.planes) {
    faces.push_back({models::FlatSurface<3>(models::lift<N>(plane.point), models::lift<N>(plane.normal)),
                     friction_in_space<N>(scene, plane.object), plane.object, plane.feature});
  }
  auto composition = std::make_unique<models::PlaneComposition>(std::move(faces));
  if (N == 1) return composition;
  std::int32_t last = -1;
  for (const auto& plane : cut.planes) {
    if (std::exchange(last, plane.object) == plane.object) continue;  // one setter per object
    out.friction_setters.emplace_back(plane.object, [planes = composition.get(), object = plane.object](double mu) {
      planes->set_friction(object, mu);
    });
  }
  return composition;
}

// Renders a mesh that is the whole scene, without a World.
SpaceAlgorithm mesh_surface(const Scene& scene, CompiledScene& out) {
  const Object& object = scene.objects.front();
  auto surface = std::make_unique<models::MeshSurface>(std::get<MeshShape>(object.shape).mesh, object.friction,
                                                       friction_by_face(scene, object));
  if (object.friction_regions.empty()) {
    out.friction_setters.emplace_back(0, [mesh = surface.get()](double mu) { mesh->set_friction(mu); });
  }
  return surface;
}

std::unique_ptr<models::Obstacle> moved(const Scene& scene, std::int32_t index, std::unique_ptr<models::Obstacle> still,
                                        CompiledScene& out) {
  const Object& object = object_at(scene, index);
  if (!object.motion) return still;
  if (!object.motion->driven) {
    return std::make_unique<models::MovingObstacle>(std::move(still), script_in_space(scene, object));
  }
  auto driven = std::make_unique<models::MovingObstacle>(std::move(still), models::Pose::Identity());
  out.driven.emplace_back(index, driven.get());
  return driven;
}

// Adds a guide on a plane among objects: two half-spaces, one on each side of the plane, which are reported as one more
// object.
void add_plane_guide(const GuideDescription& guide, std::int32_t index, Entries& entries) {
  for (const double side : {1.0, -1.0}) {
    auto half =
        std::make_unique<models::PlaneObstacle>(guide.points_m.front(), Vec3(side * guide.direction), guide.friction);
    half->set_slack(8.0);  // a point on one of the two surfaces may be behind the other one by the rounding of both
    entries.push_back({std::move(half), index, side > 0.0 ? 0 : 1});
  }
}

// Returns the obstacles of a World, one for each surface.
template <int N>
Entries entries_of(const Scene& scene, Cut<N> cut, CompiledScene& out) {
  Entries entries;
  for (const auto& plane : cut.planes) {
    entries.push_back(
        {std::make_unique<models::PlaneObstacle>(models::lift<N>(plane.point), models::lift<N>(plane.normal),
                                                 friction_in_space<N>(scene, plane.object)),
         plane.object, plane.feature});
  }
  for (const Ball& ball : cut.balls) {
    const double mu = friction_in_space<N>(scene, ball.object);
    entries.push_back(
        {std::make_unique<models::Sphere>(models::PointCore{ball.centre}, ball.radius_m, mu, ball.inside_out),
         ball.object, 0});
  }
  for (Solid& solid : cut.solids) {
    for (Part& part : solid.parts) {
      entries.push_back({moved(scene, solid.object, std::move(part.obstacle), out), solid.object, part.feature});
    }
  }
  return entries;
}

template <int N>
SpaceAlgorithm world(const Scene& scene, Cut<N> cut, CompiledScene& out) {
  Entries entries = entries_of<N>(scene, std::move(cut), out);
  for (const models::World::Entry& entry : entries) {
    // Friction that differs by triangle can't be changed.
    if (N == 1 || !object_at(scene, entry.object).friction_regions.empty()) continue;
    out.friction_setters.emplace_back(entry.object,
                                      [obstacle = entry.obstacle.get()](double mu) { obstacle->set_friction(mu); });
  }
  if (out.plan.guide) add_plane_guide(*out.plan.guide, static_cast<std::int32_t>(scene.objects.size()), entries);
  assert(entries.size() == out.plan.surfaces);
  return std::make_unique<models::World>(std::move(entries));
}

models::PolylineGuide polyline_guide(const GuideDescription& guide) {
  return guide.kind == Kind::line ? models::PolylineGuide::line(guide.points_m.front(), guide.direction, guide.friction)
                                  : models::PolylineGuide(guide.points_m, guide.closed, guide.friction);
}

SpaceAlgorithm lone_guide(const GuideDescription& guide) {
  if (guide.kind == Kind::plane) {
    return std::make_unique<models::PlaneGuide>(guide.points_m.front(), guide.direction, guide.friction);
  }
  return std::make_unique<models::PolylineGuide>(polyline_guide(guide));
}

template <int N>
SpaceAlgorithm guide_among_objects(const Scene& scene, Cut<N> cut, CompiledScene& out) {
  Entries still, movers;
  for (models::World::Entry& entry : entries_of<N>(scene, std::move(cut), out)) {
    if (entry.obstacle->moves()) entry.obstacle->set_friction(0.0);
    (entry.obstacle->moves() ? movers : still).push_back(std::move(entry));
  }
  models::PolylineGuide guide = polyline_guide(*out.plan.guide);
  guide.stop_at(std::make_shared<models::World>(std::move(still)), static_cast<std::int32_t>(scene.objects.size()));
  if (!movers.empty()) guide.be_pushed_by(std::move(movers));
  return std::make_unique<models::PolylineGuide>(std::move(guide));
}

// Returns the 𝒢 of the contacts; nullptr if there is nothing to touch.
template <int N>
Algorithm<N> contacts(const Scene& scene, Cut<N> cut, CompiledScene& out) {
  switch (out.plan.contacts) {
    case Plan::Contacts::none:
      break;
    case Plan::Contacts::plane:
      return std::make_unique<models::Plane<N>>(cut.planes.front().point, cut.planes.front().normal);
    case Plan::Contacts::friction_plane:
      return friction_plane<N>(scene, cut.planes.front(), out);
    case Plan::Contacts::planes:
      return in_space<N>(plane_composition<N>(scene, cut, out));
    case Plan::Contacts::mesh:
      return in_space<N>(mesh_surface(scene, out));
    case Plan::Contacts::guide:
      return in_space<N>(lone_guide(*out.plan.guide));
    case Plan::Contacts::guide_among_objects:
      return in_space<N>(guide_among_objects<N>(scene, std::move(cut), out));
    case Plan::Contacts::world:
      return in_space<N>(world<N>(scene, std::move(cut), out));
  }
  return nullptr;
}

std::vector<models::Medium> media(const Scene& scene, const Plan& plan) {
  std::vector<models::Medium> media;
  for (const MediumDescription& medium : scene.media) {
    media.push_back({medium.damping_Ns_per_m, medium.force_N, medium.within ? region_of(*medium.within) : nullptr});
  }
  if (plan.coulomb == Plan::Coulomb::medium) media.push_back({0.0, *scene.coulomb_force_N, nullptr});
  return media;
}

template <int N>
Algorithm<N> build(const Scene& scene, CompiledScene& out) {
  std::optional<GuideDescription> guide;
  if (scene.guide) guide = guide_in_space(scene);
  if (guide && guide->kind != Kind::plane) require_no_moving_mesh(scene);
  Cut<N> cut = cut_by_space<N>(scene);
  out.plan = plan_of<N>(scene, std::move(guide), cut);

  if (out.plan.coulomb == Plan::Coulomb::field)
    return std::make_unique<models::CoulombField<N>>(*scene.coulomb_force_N);
  Algorithm<N> g = contacts<N>(scene, std::move(cut), out);
  if (!g) g = std::make_unique<models::FreeSpace<N>>();
  std::vector<models::Medium> around = media(scene, out.plan);
  if (around.empty()) return g;
  models::Pose X_WS = models::Pose::Identity();
  X_WS.linear() = scene.space.axes;
  X_WS.translation() = scene.space.origin_m;
  return std::make_unique<models::Media<N>>(std::move(g), std::move(around), models::Media<N>::first_period_s, X_WS);
}

}  // namespace

CompiledScene compile(const Scene& scene) {
  CompiledScene out;
  out.name = scene.name;
  out.source = std::make_shared<const Scene>(scene);
  // In three dimensions, the coordinates are those of W.
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
  if (also_drive) also_drive(static_cast<std::int32_t>(object), X);
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

}  // namespace proxarm::scenes
