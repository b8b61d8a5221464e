// Gathers the pairs of features of a mesh of the tool and a mesh that is an object.
#include <algorithm>
#include <cmath>

#include "models/rigid_features/mesh_pairs.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_pairs/gathering.hpp"

namespace proxarm::models {
namespace {

// Finds the pairs of features of two faces: the vertices that a face owns with the other face, and the edges that the
// faces own with each other. Each vertex and edge has one owner, so no pair is found twice.
class OfFaces {
 public:
  OfFaces(const TriangleFeatures& own, const TriangleFeatures& other, double held, const View& at, double near,
          double turn) noexcept
      : own_(&own),
        other_(&other),
        held_(held),
        at_(at),
        near_(near),
        turn_(turn),
        corners_turn_(turn_of_corners(turn)) {}

  template <typename Add>
  void points_of_tool(std::uint32_t face, std::uint32_t other_face, Add add) const noexcept {
    const Vec3 inwards = -held_ * (at_.R.transpose() * face_of(*other_, other_face).normal);
    const NormalCone::Angle turn = other_->around(other_face) + corners_turn_;
    for (const std::uint32_t v : own_->vertices_of(face)) {
      if (held_ != 0.0 && !own_->cone(v).holds(inwards, turn)) continue;
      const double distance2 = distance2_within(other_->mesh(), other_face, at_ * own_->vertex(v), near_);
      if (distance2 <= near_ * near_) add(v, other_face, std::sqrt(distance2));
    }
  }
  template <typename Add>
  void points_of_object(std::uint32_t face, std::uint32_t other_face, Add add) const noexcept {
    const Vec3 inwards = -held_ * (at_.R * face_of(*own_, face).normal);
    const NormalCone::Angle turn = own_->around(face) + corners_turn_;
    for (const std::uint32_t v : other_->vertices_of(other_face)) {
      if (!other_->cone(v).holds(inwards, turn)) continue;
      const double distance2 = distance2_within(own_->mesh(), face, at_.to_T(other_->vertex(v)), near_);
      if (distance2 <= near_ * near_) add(face, v, std::sqrt(distance2));
    }
  }
  // Valleys are skipped: no sharp feature can touch a valley.
  template <typename Add>
  void edges(std::uint32_t face, std::uint32_t other_face, Add add) const noexcept {
    for (const std::uint32_t i : own_->edges_of(face)) {
      if (!own_->edge(i).ridge) continue;
      const EdgeLine edge = moved_edge(own_->edge(i).line, at_);
      for (const std::uint32_t j : other_->edges_of(other_face)) {
        if (other_->edge(j).ridge != (held_ > 0.0)) continue;
        EdgeLine line = other_->edge(j).line;
        const double distance2 = distance2_of_segments(edge, line);
        if (distance2 > near_ * near_) continue;
        line.left *= held_;
        line.right *= held_;
        if (!never_hold(edge, line, turn_)) add(i, j, std::sqrt(distance2));
      }
    }
  }

 private:
  const TriangleFeatures *own_, *other_;
  double held_;
  View at_;
  double near_, turn_;
  NormalCone::Angle corners_turn_;
};

}  // namespace

// Lists the leaves of all meshes that can't move. Listing twice as many leaves costs less than listing the leaves again
// in the next step. So the reach of the list is chosen such that the list has some hundreds of leaves. If there is no
// room for these, the reach of the list is the reach of the present pairs.
void Gathering::list_leaves(const ToolPose& pose, double reach) noexcept {
  constexpr std::size_t few = 384, many = 640;
  constexpr double furthest = 8.0;
  if (!out_->near_leaves.has_room() || out_->lists_leaves(*bodies_, pose, reach)) return;
  const double further = out_->list_further;
  list_leaves_within(pose, further * reach);
  const bool listed = out_->near_leaves.all();
  if (listed && out_->near_leaves.count() < few) out_->list_further = std::min(1.5 * further, furthest);
  if (!listed || out_->near_leaves.count() > many) out_->list_further = std::max(further / 1.5, 1.0);
  if (!listed && further > 1.0) list_leaves_within(pose, reach);
}

void Gathering::list_leaves_within(const ToolPose& pose, double reach) noexcept {
  const RigidSetup& setup = bodies_->setup();
  out_->near_leaves.begin(pose, reach);
  const View at = view(pose);
  for (std::size_t entry = 0; entry < setup.first_moving; ++entry) {
    const RigidEntry& e = setup.entries[entry];
    for (std::size_t i = 0; i < setup.parts.size(); ++i) {
      const RigidPart& part = setup.parts[i];
      if (!part.mesh || !e.discs.any() || !may_reach(part, e, at, reach)) continue;
      out_->near_leaves.begin_with(static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(entry));
      const MeshPairs pairs(flat_mesh(part), flat_mesh(e), at, reach);
      pairs.list([&](const MeshPairs::Leaves& leaves) { return out_->near_leaves.add(leaves); });
      if (!out_->near_leaves.all()) return;
    }
  }
}

void Gathering::gather_meshes(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const RigidSetup& setup = bodies_->setup();
  const RigidEntry& e = setup.entries[entry];
  const TriangleFeatures& own = *setup.parts[part].mesh;
  const TriangleFeatures& other = *e.mesh();
  const OfFaces of(own, other, e.held, at, reach, reach / setup.reach_m);
  const auto adds = [&](PairKind kind) {
    return [this, kind, part, entry](std::uint32_t i, std::uint32_t j, double apart_m) {
      add(kind, part, entry, i, j, apart_m);
    };
  };
  std::size_t looked_at = 0;
  const auto look_at = [&](std::uint32_t face, std::uint32_t other_face) {
    if (!take_face(looked_at)) return false;
    of.points_of_tool(face, other_face, adds(PairKind::point_face));
    of.points_of_object(face, other_face, adds(PairKind::face_point));
    of.edges(face, other_face, adds(PairKind::edges));
    return true;
  };
  MeshPairs pairs(flat_mesh(setup.parts[part]), flat_mesh(e), at, reach);
  if (!bodies_->moves(entry) && out_->near_leaves.all()) {
    pairs.each_of(out_->near_leaves.of(part, entry).value_or(NearLeaves::Items{}), look_at);
  } else {
    pairs.each(look_at);
  }
  out_->triangles_near += looked_at;
}

}  // namespace proxarm::models
