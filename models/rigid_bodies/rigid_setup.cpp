#include "models/rigid_bodies/rigid_setup.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "models/rigid_features/mesh_part.hpp"
#include "models/rigid_features/near_faces.hpp"

namespace proxarm::models {
namespace {

// The number of pairs of corners between a box and twenty other boxes. If there are more pairs and most of them came
// near, a step would have to look at too many.
constexpr std::size_t kManyCorners = 1280;

// Returns the smallest extent of a solid, m. Features on opposite sides of the solid are at least this far apart.
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

Bounds bounds_of(const RigidEntry& entry) {
  if (const Solid* solid = entry.solid()) return bounds_of(*solid, solid->radius);
  if (const TriangleFeatures* mesh = entry.mesh()) return mesh->mesh().bounds();
  return {};
}

std::optional<Cylinder> cylinder_in(const Solid& solid) {
  if (solid.rims.size() != 2) return {};
  return cylinder_of(solid);
}

void require_friction(double friction) {
  if (!(friction >= 0.0 && std::isfinite(friction))) {
    throw std::invalid_argument("a friction must be finite and not negative");
  }
}

void require_few_edges(const Solid& solid) {
  if (solid.edges.size() > NearFaces::most_edges) throw std::invalid_argument("a hull of more than 2000 points");
}

// Whether a part and an object both have edges, and at least one of the two bodies is round.
bool meet_along_edges(const Solid& part, const RigidEntry& entry) {
  const Solid* solid = entry.solid();
  const bool has_edges = solid != nullptr ? !solid->edges.empty() : entry.mesh() != nullptr;
  if (part.edges.empty() || !has_edges) return false;
  return part.radius > 0.0 || (solid != nullptr && solid->radius > 0.0);
}

// Throws if the object is of a kind that can't hold a cylinder of the tool.
void require_contact_with_cylinder(const RigidEntry& entry) {
  const auto* tube = std::get_if<HollowTube>(&entry.object.shape);
  if (tube != nullptr && !tube->endless) {
    throw std::invalid_argument("a cylinder as a tool isn't held by the round ends of a tube");
  }
  const TriangleFeatures* mesh = entry.mesh();
  if (mesh != nullptr && !mesh->mesh().closed()) {
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

void add_part(const ToolPart& part, RigidSetup& setup) {
  auto [mesh, solid, thick] = part_of(part);
  if (part.friction) require_friction(*part.friction);
  if (!mesh) require_few_edges(solid);
  setup.thinness_m = std::min(setup.thinness_m, thick);
  setup.mesh_tool = setup.mesh_tool || mesh;
  setup.reach_m = std::max(setup.reach_m, solid.reach);
  setup.bends = setup.bends || !solid.rims.empty();
  const Bounds box = bounds_of(solid, 0.0);
  const std::optional<Cylinder> cylinder = cylinder_in(solid);
  setup.parts.push_back({std::move(solid), box, part.friction, std::move(mesh), cylinder});
}

void add_entry(RigidObject&& object, RigidSetup& setup) {
  require_friction(object.friction);
  RigidEntry entry{.object = std::move(object), .bounds = {}};
  for (const RigidPart& part : setup.parts) {
    if (part.cylinder) require_contact_with_cylinder(entry);
    setup.edges_bend = setup.edges_bend || meet_along_edges(part.solid, entry);
  }
  entry.bounds = entry.box = bounds_of(entry);
  if (const Solid* solid = entry.solid()) {
    require_few_edges(*solid);
    setup.thinness_m = std::min(setup.thinness_m, thickness(*solid));
    entry.box = bounds_of(*solid, 0.0);
    entry.cylinder = cylinder_in(*solid);
  }
  const bool hollow = std::holds_alternative<HollowSphere>(entry.object.shape) ||
                      std::holds_alternative<HollowTube>(entry.object.shape);
  setup.hollow = setup.hollow || hollow;
  setup.bends = setup.bends || hollow || entry.cylinder;
  if (const TriangleFeatures* mesh = entry.mesh()) {
    setup.mesh_objects = true;
    entry.held = (entry.object.inside_out ? -1.0 : 1.0) * mesh->outwards();
  }
  setup.entries.push_back(std::move(entry));
}

bool has_many_corners(const RigidSetup& setup) {
  std::size_t of_objects = 0, of_tool = 0;
  for (const RigidEntry& entry : setup.entries)
    of_objects += entry.solid() != nullptr ? entry.solid()->points.size() : 0;
  for (const RigidPart& part : setup.parts) of_tool += part.solid.points.size();
  return of_objects * of_tool > kManyCorners;
}

}  // namespace

RigidSetup rigid_setup(const Tool& tool, std::vector<RigidObject> objects) {
  if (tool.parts.empty()) throw std::invalid_argument("a rigid tool needs a part; a point is rendered by a World");
  RigidSetup setup;
  for (const ToolPart& part : tool.parts) add_part(part, setup);
  for (RigidObject& object : objects) {
    if (!object.motion) add_entry(std::move(object), setup);
  }
  setup.first_moving = setup.entries.size();
  for (RigidObject& object : objects) {
    if (object.motion) add_entry(std::move(object), setup);
  }
  setup.dense = setup.mesh_tool || setup.mesh_objects || has_many_corners(setup);
  if (setup.mesh_tool && setup.mesh_objects) {
    for (RigidPart& part : setup.parts) {
      if (part.mesh) part.discs = NodeDiscs(part.mesh->mesh());
    }
    for (RigidEntry& entry : setup.entries) {
      if (entry.mesh() != nullptr) entry.discs = NodeDiscs(entry.mesh()->mesh());
    }
  }
  return setup;
}

}  // namespace proxarm::models
