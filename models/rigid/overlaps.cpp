#include "models/rigid/overlaps.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "models/rigid_features/mesh_pairs.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_shapes/overlap.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {
namespace {

// Returns whether the tool should be inside a mesh; nullopt for an open mesh, which has no inside.
std::optional<bool> should_be_inside(const RigidEntry& mesh) noexcept {
  return mesh.held != 0.0 ? std::optional<bool>(mesh.object.inside_out) : std::nullopt;
}

// Returns how deep a part of the tool stands in an object, negative, m; 0 or more if it doesn't. Precondition: the
// object is a solid or a mesh.
double overlap_of(const RigidPart& part, const RigidEntry& entry, const View& at, const Apart& apart) noexcept {
  if (const TriangleFeatures* mesh = entry.mesh()) {
    const std::optional<bool> inside = should_be_inside(entry);
    if (part.mesh) return overlap_of_meshes(flat_mesh(part), flat_mesh(entry), at, inside);
    return overlap_with_mesh(part.solid, part.box, mesh->mesh(), at, inside, apart);
  }
  const Solid& solid = *entry.solid();
  if (part.mesh) {
    std::array<Vec3, Overlaps::most_planes> normals;
    const std::size_t count = std::min(apart.normals.size(), normals.size());
    for (std::size_t i = 0; i < count; ++i) normals[i] = -(at.R.transpose() * apart.normals[i]);
    return overlap_with_mesh(solid, entry.box, part.mesh->mesh(), inverse(at), false,
                             {apart.enough, {normals.data(), count}, apart.last, apart.triangles});
  }
  if (part.cylinder && entry.cylinder) {
    return separation_of_cylinders(moved(*part.cylinder, at.R, at.x), *entry.cylinder);
  }
  if (part.cylinder) return separation_of_cylinder(moved(*part.cylinder, at.R, at.x), solid);
  if (entry.cylinder) {
    const View to = inverse(at);
    return separation_of_cylinder(moved(*entry.cylinder, to.R, to.x), part.solid);
  }
  if (part.solid.faces.empty() && solid.faces.empty()) return 0.0;
  const double gap = separation_of_hulls(part.solid, isometry(at), solid, apart.enough);
  return gap < 0.0 ? gap - (part.solid.radius + solid.radius) : gap;
}

}  // namespace

double Overlaps::overlap_m(const ToolPose& pose, const Apart& apart) noexcept {
  const RigidSetup& setup = bodies_->setup();
  double deepest = std::numeric_limits<double>::infinity();
  const View tool = view(pose);
  const bool leaves_listed = candidates_->lists_leaves(*bodies_, pose, 0.0);
  const bool triangles_listed = candidates_->lists_triangles(*bodies_, pose);
  for (std::size_t i = 0; i < setup.entries.size(); ++i) {
    const RigidEntry& e = setup.entries[i];
    const bool is_mesh = e.mesh() != nullptr;
    const auto entry = static_cast<std::uint16_t>(i);
    const bool moves = bodies_->moves(entry);
    if ((e.solid() == nullptr && !is_mesh) || (moves && !bodies_->moving(entry).close)) continue;
    const View at = bodies_->seen_from(entry, tool);
    // A far object is skipped, except a mesh that should enclose the tool: a tool outside of such a mesh is on the
    // wrong side.
    const bool beyond = distance2_to_box(at.x, e.bounds) > setup.reach_m * setup.reach_m;
    if (beyond && !e.object.inside_out) continue;
    for (std::size_t k = 0; k < setup.parts.size(); ++k) {
      const auto part = static_cast<std::uint16_t>(k);
      const bool known = leaves_listed && is_mesh && setup.parts[k].mesh && !moves;
      Apart here{.enough = apart.enough};
      if (!moves) here.normals = apart.normals;
      const bool one_is_mesh = is_mesh != (setup.parts[k].mesh != nullptr);
      if (one_is_mesh && !moves) {
        here.last = &last_planes_->of(part, entry);
        if (triangles_listed) here.triangles = candidates_->near_triangles.of(part, entry);
      }
      const double gap = known ? of_near_leaves(part, entry, at) : overlap_of(setup.parts[k], e, at, here);
      if (gap < 0.0) deepest = std::min(deepest, gap);
    }
  }
  return deepest;
}

double Overlaps::of_near_leaves(std::uint16_t part, std::uint16_t entry, const View& at) const noexcept {
  const RigidEntry& e = bodies_->setup().entries[entry];
  const FlatMesh own = flat_mesh(bodies_->setup().parts[part]), other = flat_mesh(e);
  MeshPairs pairs(own, other, at, 0.0);
  double deepest = 0.0;
  pairs.each_of(candidates_->near_leaves.of(part, entry).value_or(NearLeaves::Items{}),
                [&](std::uint32_t face, std::uint32_t other_face) {
                  deepest = std::min(deepest, overlap_of_faces(own.mesh, face, other.mesh, other_face, at));
                  return true;
                });
  if (deepest < 0.0) return deepest;
  return overlap_of_all(own.mesh, other.mesh, at, should_be_inside(e));
}

}  // namespace proxarm::models
