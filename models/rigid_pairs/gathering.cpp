#include "models/rigid_pairs/gathering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid_features/near.hpp"
#include "models/rigid_pairs/feature_pairs.hpp"

namespace proxarm::models {
namespace {

// If there are more pairs than this, the reach is reduced: a pair costs some 15 ns at each pose of a step.
constexpr std::size_t kFewPairs = 192;
// The same for triangles: a triangle costs some 100 ns whenever pairs are gathered.
constexpr std::size_t kFewFaces = 256;
// A length is reduced by this share, so that rounding to a float doesn't make it larger than the length was.
constexpr double kOfFloats = std::numeric_limits<float>::epsilon();

// Returns the kind of a pair after its two features were exchanged.
PairKind other_way_round(PairKind kind) noexcept {
  switch (kind) {
    case PairKind::point_face:
      return PairKind::face_point;
    case PairKind::face_point:
      return PairKind::point_face;
    case PairKind::point_edge:
      return PairKind::edge_point;
    case PairKind::edge_point:
      return PairKind::point_edge;
    default:
      return kind;
  }
}

}  // namespace

// If many triangles are near, the reach of the pairs is only as large as this step needs, because each pair costs time
// in every step, and each triangle in every gathering:
// 1. The smallest reach is 1.5 times the motion of the step. The step is then taken in three parts, each at most a
//    quarter of the reach long. (With a reach of 3 times the motion, and two parts, the slowest steps of a hull or a
//    mesh took nearly twice as long.)
// 2. If there isn't even room for the pairs within the smallest reach, the reach is halved further, and the step is
//    taken in more parts.
void Gathering::gather_for(const ToolPose& q, double far_m) noexcept {
  const RigidSetup& setup = bodies_->setup();
  const double least = 1.5 * far_m + 1e-6;
  double reach = 3.0 * far_m + std::max(8.0 * far_m, 0.01 * setup.reach_m) + 1e-6;
  if (setup.dense && out_->gathered_reach_m > 0.0) {
    const bool few = out_->count < kFewPairs / 4 && out_->triangles_near < kFewFaces / 4;
    reach = std::clamp((few ? 2.0 : 1.0) * out_->gathered_reach_m, least, reach);
  }
  const std::size_t pairs = setup.dense ? kFewPairs : Candidates::most_pairs;
  const std::size_t faces = setup.dense ? kFewFaces : NearFaces::most_faces;
  const KeptPairs kept = pressed_pairs();
  for (; reach > 1.5 * least; reach *= 0.5) {
    if (look_around(q, reach, pairs, faces)) return restore(kept);
  }
  reach = least;
  for (int k = 0; k < 10 && !look_around(q, reach); ++k) reach *= 0.5;
  restore(kept);
}

void Gathering::gather(const ToolPose& pose, double reach_m) noexcept {
  const KeptPairs kept = pressed_pairs();
  look_around(pose, reach_m);
  restore(kept);
}

// Gathers the pairs within `reach`. Returns whether there was room for all pairs and triangles; if not, the search ends
// early.
bool Gathering::look_around(const ToolPose& pose, double reach, std::size_t pairs, std::size_t faces) noexcept {
  const RigidSetup& setup = bodies_->setup();
  pair_room_ = pairs;
  face_room_ = faces;
  out_->count = out_->pressed.count = out_->triangles_near = 0;
  out_->crowded = false;
  list_leaves(pose, reach);
  if (out_->near_triangles.has_room()) out_->near_triangles.begin(pose, reach);
  for (std::size_t i = 0; i < setup.first_moving; ++i) gather_entry(static_cast<std::uint16_t>(i), pose, reach);
  out_->still_count = out_->count;
  for (std::size_t i = setup.first_moving; i < setup.entries.size(); ++i) {
    gather_entry(static_cast<std::uint16_t>(i), pose, reach);
    MovingEntry& m = bodies_->moving(static_cast<std::uint16_t>(i));
    m.gathered = m.mover.at().back(pose);
  }
  out_->gathered_at = pose;
  out_->gathered_reach_m = reach;
  return !out_->crowded;
}

// Returns the pairs that pressed, so that restore() can give them their sides and forces back after a gathering.
Gathering::KeptPairs Gathering::pressed_pairs() const noexcept {
  KeptPairs kept;
  for (const Pair& pair : out_->all()) {
    if (kept.count == kept.pairs.size()) break;
    if (pair.pressed) kept.pairs[kept.count++] = pair;
  }
  return kept;
}

void Gathering::restore(const KeptPairs& kept) noexcept {
  for (std::size_t k = 0; k < kept.count; ++k) {
    const Pair& old = kept.pairs[k];
    for (Pair& pair : out_->all()) {
      if (pair.kind != old.kind || pair.part != old.part || pair.entry != old.entry) continue;
      if (pair.own != old.own || pair.other != old.other) continue;
      const float apart_m = pair.apart_m;
      pair = old;
      pair.apart_m = apart_m;
    }
  }
}

bool Gathering::may_reach(const RigidPart& part, const RigidEntry& entry, const View& at, double reach) noexcept {
  if (!part.box.finite()) return true;
  const double near = 0.5 * (part.box.high - part.box.low).norm() + part.solid.radius + reach;
  return distance2_to_box(at * Vec3(0.5 * (part.box.low + part.box.high)), entry.bounds) <= near * near;
}

void Gathering::gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept {
  const RigidSetup& setup = bodies_->setup();
  const RigidEntry& e = setup.entries[entry];
  const View at = bodies_->seen_from(entry, view(pose));
  const double around = setup.reach_m + reach;
  if (distance2_to_box(at.x, e.bounds) > around * around) return;
  for (std::size_t i = 0; i < setup.parts.size() && !out_->crowded; ++i) {
    if (may_reach(setup.parts[i], e, at, reach)) gather_part(static_cast<std::uint16_t>(i), entry, at, reach);
  }
}

void Gathering::gather_part(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const RigidSetup& setup = bodies_->setup();
  const RigidPart& own = setup.parts[part];
  const RigidEntry& e = setup.entries[entry];
  const Solid* solid = e.solid();
  const TriangleFeatures* mesh = e.mesh();
  if (solid == nullptr && mesh == nullptr) return gather_flat_or_hollow(part, entry, at, reach);
  if (e.cylinder || own.cylinder) return gather_cylinder(part, entry, at, reach);
  if (mesh != nullptr && own.mesh) return gather_meshes(part, entry, at, reach);
  const double turn = reach / setup.reach_m;
  const auto add_as_is = [&](PairKind kind, std::uint32_t i, std::uint32_t j, double apart_m) {
    add(kind, part, entry, i, j, apart_m);
  };
  if (mesh != nullptr) {
    NearFaces close(own.solid, own.box, *mesh, e.held, at, reach, turn, face_room_);
    if (!list_triangles(part, entry, close)) return;
    return PairsWithMesh(own.solid, *mesh, e.held, at, close, out_->crowded, add_as_is).add_all();
  }
  if (!own.mesh) return PairsOfSolids(own, e, at, reach, turn, add_as_is).add_all();
  // The tool's part is a mesh: in the tool's frame the object is a solid near this mesh.
  const View from_tool = inverse(at);
  NearFaces close(*solid, e.box, *own.mesh, 1.0, from_tool, reach, turn, face_room_);
  if (!list_triangles(part, entry, close)) return;
  const auto add_reversed = [&](PairKind kind, std::uint32_t i, std::uint32_t j, double apart_m) {
    add(other_way_round(kind), part, entry, j, i, apart_m);
  };
  PairsWithMesh(*solid, *own.mesh, 1.0, from_tool, close, out_->crowded, add_reversed).add_all();
}

void Gathering::gather_flat_or_hollow(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const Solid& own = bodies_->setup().parts[part].solid;
  with_flat_or_hollow(bodies_->setup().entries[entry].object, [&](const auto& shape) {
    for (std::uint32_t i = 0; i < own.points.size(); ++i) {
      const double gap = touch(shape, at * own.points[i], own.radius).gap;
      if (gap <= reach) add(PairKind::point_field, part, entry, i, 0, gap);
    }
    for (std::uint32_t i = 0; i < own.rims.size(); ++i) {
      const Solid::Rim& rim = own.rims[i];
      if (touch(shape, at * rim.centre, rim.radius).gap <= reach) add(PairKind::rim_field, part, entry, i, 0, 0.0);
    }
  });
}

void Gathering::add(PairKind kind, std::uint16_t part, std::uint16_t entry, std::uint32_t own, std::uint32_t other,
                    double apart_m) noexcept {
  if (out_->count == pair_room_) {
    out_->crowded = true;
    return;
  }
  Pair& pair = out_->pairs[out_->count++];
  pair = {};
  pair.kind = kind;
  pair.part = part;
  pair.entry = entry;
  pair.own = own;
  pair.other = other;
  pair.apart_m = static_cast<float>(apart_m * (1.0 - kOfFloats));
}

// Adds the near triangles to the list if the object can't move. Returns false if no triangle is near or if too many
// are.
bool Gathering::list_triangles(std::uint16_t part, std::uint16_t entry, const NearFaces& close) noexcept {
  out_->crowded = out_->crowded || !close.all();
  if (!close.all()) return false;
  out_->triangles_near += close.faces().size();
  if (!bodies_->moves(entry) && out_->near_triangles.all()) {
    out_->near_triangles.begin_with(part, entry);
    for (const std::uint32_t face : close.faces()) out_->near_triangles.add(face);
  }
  return !close.faces().empty();
}

bool Gathering::take_face(std::size_t& looked_at) noexcept {
  out_->crowded = out_->crowded || looked_at++ == face_room_;
  return !out_->crowded;
}

}  // namespace proxarm::models
