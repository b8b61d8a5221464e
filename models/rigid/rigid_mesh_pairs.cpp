// Which pairs of features of a mesh that is a part of the tool and of one that is an object may meet.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/mesh_pairs.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// The vertices and the edges that the faces of a pair own, against the other face and against each other: since each
// belongs to one face, no pair comes twice.
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
  // A valley is touched by nothing sharp.
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

bool RigidWorld::lists_leaves(const ToolPose& pose, double reach) const noexcept {
  return near_leaves_.all() && motion(pose, near_leaves_.at()) + reach <= near_leaves_.reach();
}

// Of all meshes that stand still. To list twice as many costs less than to list them again in the next step: as far
// around as some hundreds of them are, and for what is gathered now if there is no room for so many.
void RigidWorld::list_leaves(const ToolPose& pose, double reach) noexcept {
  constexpr std::size_t few = 384, many = 640;
  constexpr double furthest = 8.0;
  if (!near_leaves_.has_room() || lists_leaves(pose, reach)) return;
  const double further = list_further_;
  list_leaves_within(pose, further * reach);
  const bool listed = near_leaves_.all();
  if (listed && near_leaves_.count() < few) list_further_ = std::min(1.5 * further, furthest);
  if (!listed || near_leaves_.count() > many) list_further_ = std::max(further / 1.5, 1.0);
  if (!listed && further > 1.0) list_leaves_within(pose, reach);
}

void RigidWorld::list_leaves_within(const ToolPose& pose, double reach) noexcept {
  near_leaves_.begin(pose, reach);
  const View at = view(pose);
  for (std::size_t entry = 0; entry < shared_->first_moving; ++entry) {
    const Entry& e = shared_->entries[entry];
    for (std::size_t i = 0; i < shared_->parts.size(); ++i) {
      const Part& part = shared_->parts[i];
      if (!part.mesh || !e.discs.any() || !may_reach(part, e, at, reach)) continue;
      near_leaves_.begin_with(static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(entry));
      const MeshPairs pairs(flat_mesh(part), flat_mesh(e), at, reach);
      pairs.list([&](const MeshPairs::Leaves& leaves) { return near_leaves_.add(leaves); });
      if (!near_leaves_.all()) return;
    }
  }
}

void RigidWorld::gather_meshes(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const Entry& e = shared_->entries[entry];
  const TriangleFeatures& own = *shared_->parts[part].mesh;
  const TriangleFeatures& other = **std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape);
  const OfFaces of(own, other, e.held, at, reach, reach / shared_->reach);
  const auto add = [&](Kind kind) {
    return [this, kind, part, entry](std::uint32_t i, std::uint32_t j, double apart_m) {
      add_pair(kind, part, entry, i, j, apart_m);
    };
  };
  std::size_t looked_at = 0;
  const auto look_at = [&](std::uint32_t face, std::uint32_t other_face) {
    crowded_ = crowded_ || looked_at++ == face_room_;
    if (crowded_) return false;
    of.points_of_tool(face, other_face, add(Kind::point_face));
    of.points_of_object(face, other_face, add(Kind::face_point));
    of.edges(face, other_face, add(Kind::edges));
    return true;
  };
  MeshPairs pairs(flat_mesh(shared_->parts[part]), flat_mesh(e), at, reach);
  if (!moves(entry) && near_leaves_.all()) {
    pairs.each_of(near_leaves_.of(part, entry).value_or(NearLeaves::Items{}), look_at);
  } else {
    pairs.each(look_at);
  }
  near_faces_ += looked_at;
}

}  // namespace proxarm::models
