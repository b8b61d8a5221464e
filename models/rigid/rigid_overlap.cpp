// Whether the tool stands in an object: how far it is from there, for figures, and whether a step has led it in.
#include <algorithm>
#include <array>
#include <optional>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/mesh_overlap.hpp"
#include "models/rigid_features/mesh_pairs.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_shapes/overlap.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {
namespace {

constexpr std::size_t kMostPlanes = 8;  // more contacts than hold a tool

// Of a mesh; an open one has no inside.
std::optional<bool> should_be_inside(const RigidObject& mesh, double held) noexcept {
  return held != 0.0 ? std::optional<bool>(mesh.inside_out) : std::nullopt;
}

}  // namespace

double RigidWorld::clearance_m(const ToolPose& pose) const noexcept {
  RigidWorld copy(*this);
  for (Moving& m : copy.moving_) m.close = true;
  return copy.least_gap_m(pose);
}

// Of all objects that are close, wherever they are.
double RigidWorld::least_gap_m(const ToolPose& pose) noexcept {
  constexpr double first_m = 1e-3, furthest_m = 1e6, nearest_m = 1e-9;
  double least = std::numeric_limits<double>::infinity(), empty = 0.0;
  riding_ = nobody;
  for (double far = first_m; far < furthest_m && far > nearest_m;) {
    pair_count_ = 0;
    gather(pose, far);
    if (crowded_) {  // nearer, or else what was empty last is all that is known
      if (empty > 0.0) return std::min(empty, overlap_m(pose));
      far *= 0.25;
      continue;
    }
    set_sides(pose, 0.0);
    find(pose);
    for (std::size_t i = 0; i < found_count_; ++i) least = std::min(least, found_[i].touch.gap);
    if (least < far) break;
    empty = far;
    far *= 4.0;
  }
  return std::min(least, overlap_m(pose));
}

// Features have their gaps on the side on which the tool was. Where it is inside of a solid, or stands in a surface,
// that says nothing.
double RigidWorld::overlap_m(const ToolPose& pose, const Apart& apart) noexcept {
  double deepest = std::numeric_limits<double>::infinity();
  const View tool = view(pose);
  const bool listed = lists_leaves(pose, 0.0);
  const bool triangles_listed = near_triangles_.all() && motion(pose, near_triangles_.at()) <= near_triangles_.reach();
  for (std::size_t i = 0; i < shared_->entries.size(); ++i) {
    const Entry& e = shared_->entries[i];
    const auto* solid = std::get_if<Solid>(&e.object.shape);
    const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape);
    const auto entry = static_cast<std::uint16_t>(i);
    if ((solid == nullptr && mesh == nullptr) || (moves(entry) && !moving(entry).close)) continue;
    const View at = seen_from(entry, tool);
    const bool beyond = distance2_to_box(at.x, e.bounds) > shared_->reach * shared_->reach;
    if (beyond && !e.object.inside_out)
      continue;  // (beyond a mesh that it should be inside of, it is on the wrong side)
    for (std::size_t k = 0; k < shared_->parts.size(); ++k) {
      const auto part = static_cast<std::uint16_t>(k);
      const bool known = listed && mesh != nullptr && shared_->parts[part].mesh && !moves(entry);
      Apart here{.enough = apart.enough};
      if (!moves(entry)) here.normals = apart.normals;
      const bool one_is_mesh = (mesh != nullptr) != (shared_->parts[part].mesh != nullptr);
      if (one_is_mesh && !moves(entry)) {
        here.last = &last_planes_.of(part, entry);
        if (triangles_listed) here.triangles = near_triangles_.of(part, entry);
      }
      const double gap = known ? overlap_of_near_leaves(part, entry, at) : overlap_m(shared_->parts[part], e, at, here);
      if (gap < 0.0) deepest = std::min(deepest, gap);
    }
  }
  return deepest;
}

double RigidWorld::overlap_of_near_leaves(std::uint16_t part, std::uint16_t entry, const View& at) const noexcept {
  const Entry& e = shared_->entries[entry];
  const FlatMesh own = flat_mesh(shared_->parts[part]), other = flat_mesh(e);
  MeshPairs pairs(own, other, at, 0.0);
  double deepest = 0.0;
  pairs.each_of(near_leaves_.of(part, entry).value_or(NearLeaves::Items{}),
                [&](std::uint32_t face, std::uint32_t other_face) {
                  deepest = std::min(deepest, overlap_of_faces(own.mesh, face, other.mesh, other_face, at));
                  return true;
                });
  if (deepest < 0.0) return deepest;
  return overlap_of_all(own.mesh, other.mesh, at, should_be_inside(e.object, e.held));
}

// How deep a part of the tool stands in an object, or how far it is from a mesh's surface on the wrong side of it; 0 or
// more if neither.
double RigidWorld::overlap_m(const Part& part, const Entry& entry, const View& at, const Apart& apart) noexcept {
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&entry.object.shape);
  if (mesh != nullptr) {
    const std::optional<bool> inside = should_be_inside(entry.object, entry.held);
    if (part.mesh) return overlap_of_meshes(flat_mesh(part), flat_mesh(entry), at, inside);
    return overlap_with_mesh(part.solid, part.box, (*mesh)->mesh(), at, inside, apart);
  }
  const Solid& solid = *std::get_if<Solid>(&entry.object.shape);
  if (part.mesh) {
    std::array<Vec3, kMostPlanes> normals;
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

// Where a mesh bends both ways, as at a valley's end, a corner of the tool may be behind faces and have its foot on
// none of them: nothing then holds it, and it would go in, though all else rests where it did. And among solids a pose
// of the iteration may have left all that pressed in the one before, over an edge, and p̂ is in there. A tool that went
// in goes back to where it was.
bool RigidWorld::went_in(const ToolPose& q_old) noexcept {
  if (!may_be_in()) return false;
  if (something_comes()) let_go(1.0);  // all the way, though the tool's parts may have ended before
  if (!stands_in(q_)) return false;
  q_ = something_comes() ? out_of_its_way(q_old) : q_old;
  return true;
}

// Where the tool was, or where that is on something that moves: the first that isn't in anything. If there is none, it
// stays where it is, and has no room there.
ToolPose RigidWorld::out_of_its_way(const ToolPose& q_old) noexcept {
  if (!stands_in(q_old)) return q_old;
  for (const Moving& m : moving_) {
    if (!m.close || m.mover.rests()) continue;
    const ToolPose with = m.mover.at() * m.mover.was().back(q_old);
    if (!stands_in(with)) return with;
  }
  squeezed_ = true;
  return q_;
}

// What the tool touches is mostly on the other side of a plane through a contact, and so is what is next to it.
bool RigidWorld::stands_in(const ToolPose& pose) noexcept {
  std::array<Vec3, kMostPlanes> normals;
  const std::size_t count = std::min(linear_count_, normals.size());
  for (std::size_t k = 0; k < count; ++k) normals[k] = -found_[of_linear_[k]].touch.normal;
  return overlap_m(pose, {.enough = -kGap_m, .normals = {normals.data(), count}}) < -kGap_m;
}

}  // namespace proxarm::models
