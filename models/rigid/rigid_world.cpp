#include "models/rigid/rigid_world.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "models/rigid_features/mesh_part.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {
namespace {

// More pairs of corners than a box has among twenty others: where most of them came near, a step would look at too
// much.
constexpr std::size_t kManyCorners = 1280;

// The least extent of a solid; features on its far side are that far away.
double thickness(const Solid& solid) {
  double least = std::numeric_limits<double>::infinity();
  if (solid.radius > 0.0) return solid.radius;
  for (const Solid::Face& face : solid.faces) {
    double low = face.offset;
    for (const Vec3& p : solid.points) low = std::min(low, face.normal.dot(p));
    least = std::min(least, face.offset - low);
  }
  if (solid.rims.size() == 2) {
    least = std::min(2.0 * solid.rims[0].radius, (solid.rims[0].centre - solid.rims[1].centre).norm());
  }
  return least;
}

Bounds bounds_of(const Solid& solid, double around) {
  Bounds bounds;
  for (int k = 0; k < 3; ++k) {
    bounds.low[k] = -extent_along(solid, -Vec3::Unit(k)) + solid.radius - around;
    bounds.high[k] = extent_along(solid, Vec3::Unit(k)) - solid.radius + around;
  }
  return bounds;
}

std::optional<Cylinder> cylinder_in(const Solid& solid) {
  if (solid.rims.size() != 2) return {};
  return cylinder_of(solid);
}

bool has_edges(const RigidObject& object) {
  const Solid* solid = std::get_if<Solid>(&object.shape);
  return solid != nullptr ? !solid->edges.empty()
                          : std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(object.shape);
}

// Whether they have edges that may meet, of which one is round.
bool meet_along_edges(const Solid& part, const RigidObject& object) {
  if (part.edges.empty() || !has_edges(object)) return false;
  const Solid* solid = std::get_if<Solid>(&object.shape);
  return part.radius > 0.0 || (solid != nullptr && solid->radius > 0.0);
}

// What no contact is known for.
void require_contact(bool cylinder, const RigidObject& object) {
  if (!cylinder) return;
  const auto* tube = std::get_if<HollowTube>(&object.shape);
  if (tube != nullptr && !tube->endless) {
    throw std::invalid_argument("a cylinder as a tool isn't held by the round ends of a tube");
  }
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  if (mesh != nullptr && !(*mesh)->mesh().closed()) {
    throw std::invalid_argument("a cylinder as a tool isn't held by an open mesh");
  }
}

MeshPart part_of(const ToolPart& part) {
  if (const auto* mesh = std::get_if<MeshTool>(&part.shape)) return mesh_part(*mesh, part.X_TP);
  MeshPart out;
  std::visit(
      [&](const auto& shape) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, MeshTool>) out.solid = solid_of(shape, part.X_TP);
      },
      part.shape);
  out.thickness_m = thickness(out.solid);
  return out;
}

Bounds bounds_of(const RigidObject& object) {
  if (const Solid* solid = std::get_if<Solid>(&object.shape)) return bounds_of(*solid, solid->radius);
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape)) {
    return (*mesh)->mesh().bounds();
  }
  return {};
}

}  // namespace

RigidWorld::RigidWorld(const RigidWorld&) = default;
RigidWorld& RigidWorld::operator=(const RigidWorld&) noexcept = default;
RigidWorld::~RigidWorld() = default;

std::unique_ptr<PoseAlgorithm> RigidWorld::clone() const { return std::make_unique<RigidWorld>(*this); }

void RigidWorld::copy_state(const PoseAlgorithm& other) noexcept { *this = dynamic_cast<const RigidWorld&>(other); }

RigidWorld::RigidWorld(const Tool& tool, std::vector<RigidObject> objects) {
  if (tool.parts.empty()) throw std::invalid_argument("a rigid tool needs a part; a point is rendered by a World");
  auto shared = std::make_shared<Shared>();
  shared->thinness = std::numeric_limits<double>::infinity();
  for (const ToolPart& part : tool.parts) {
    auto [mesh, solid, thick] = part_of(part);
    if (part.friction && !(*part.friction >= 0.0 && std::isfinite(*part.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    if (!mesh && solid.edges.size() > most_edges) throw std::invalid_argument("a hull of more than 2000 points");
    shared->thinness = std::min(shared->thinness, thick);
    shared->dense = shared->dense || mesh;
    shared->reach = std::max(shared->reach, solid.reach);
    shared->bends = shared->bends || !solid.rims.empty();
    const Bounds box = bounds_of(solid, 0.0);
    const std::optional<Cylinder> cylinder = cylinder_in(solid);
    shared->parts.push_back({std::move(solid), box, part.friction, std::move(mesh), cylinder});
  }
  std::vector<RigidObject> still_first;
  for (RigidObject& object : objects) {
    if (!object.motion) still_first.push_back(std::move(object));
  }
  shared->first_moving = still_first.size();
  for (RigidObject& object : objects) {
    if (object.motion) still_first.push_back(std::move(object));
  }
  std::size_t corners = 0, own_corners = 0;
  for (RigidObject& object : still_first) {
    if (!(object.friction >= 0.0 && std::isfinite(object.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    for (const Part& part : shared->parts) {
      require_contact(part.cylinder.has_value(), object);
      shared->edges_bend = shared->edges_bend || meet_along_edges(part.solid, object);
    }
    std::optional<Cylinder> cylinder;
    if (const Solid* solid = std::get_if<Solid>(&object.shape)) {
      shared->thinness = std::min(shared->thinness, thickness(*solid));
      cylinder = cylinder_in(*solid);
      shared->bends = shared->bends || cylinder;
    }
    shared->hollow = shared->hollow || std::holds_alternative<HollowSphere>(object.shape) ||
                     std::holds_alternative<HollowTube>(object.shape);
    shared->bends = shared->bends || shared->hollow;
    const Bounds bounds = bounds_of(object);
    double held = 0.0;
    if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape)) {
      shared->dense = true;
      held = (object.inside_out ? -1.0 : 1.0) * (*mesh)->outwards();
    }
    corners += std::holds_alternative<Solid>(object.shape) ? std::get_if<Solid>(&object.shape)->points.size() : 0;
    friction_.push_back(object.friction);
    if (object.motion) {
      const Vec3 middle = bounds.finite() ? Vec3(0.5 * (bounds.low + bounds.high)) : Vec3(Vec3::Zero());
      moving_.push_back({object.motion->driven ? RigidMover(middle) : RigidMover(object.motion->script)});
    }
    const Solid* solid = std::get_if<Solid>(&object.shape);
    const Bounds box = solid != nullptr ? bounds_of(*solid, 0.0) : bounds;
    shared->entries.push_back({std::move(object), bounds, box, held, cylinder});
  }
  for (const Part& part : shared->parts) own_corners += part.solid.points.size();
  shared->dense = shared->dense || corners * own_corners > kManyCorners;
  // Where gaps bend, most of the iteration is rough, and a peg that goes by the closed form ends more often in a jam
  // that has no solution: in 17 of 8,000 steps where it was none.
  problem_.use_closed_form(!shared->bends);
  const auto is_mesh = [](const Entry& e) {
    return std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(e.object.shape);
  };
  const std::size_t met = shared->parts.size() * shared->first_moving;
  const bool of_tool = std::any_of(shared->parts.begin(), shared->parts.end(), [](const Part& p) { return p.mesh; });
  const bool of_objects = std::any_of(shared->entries.begin(), shared->entries.end(), is_mesh);
  if (of_tool || of_objects) near_triangles_.make_room(most_faces, met);
  if (of_tool && of_objects) {
    near_leaves_.make_room(most_leaves, met);
    for (Part& part : shared->parts) {
      if (part.mesh) part.discs = NodeDiscs(flat_mesh(part).mesh);
    }
    for (Entry& e : shared->entries) {
      if (is_mesh(e)) e.discs = NodeDiscs(flat_mesh(e).mesh);
    }
  }
  shared_ = std::move(shared);
}

double RigidWorld::motion(const ToolPose& a, const ToolPose& b) const noexcept {
  return a == b ? 0.0 : size_m(difference(a, b));
}

double RigidWorld::size_m(const Twist& xi) const noexcept {
  return xi.head<3>().norm() + shared_->reach * xi.tail<3>().norm();
}

double RigidWorld::friction(const Pair& pair) const noexcept {
  const double mu = friction_[pair.entry];
  const std::optional<double>& own = shared_->parts[pair.part].friction;
  return own ? std::sqrt(*own * mu) : mu;
}

void RigidWorld::set_friction(std::int32_t object, double friction) noexcept {
  for (std::size_t i = 0; i < friction_.size(); ++i) {
    if (shared_->entries[i].object.object == object) friction_[i] = friction;
  }
}

}  // namespace proxarm::models
