// Which pairs of features may meet in the steps to come.
#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// More pairs than this are worth a smaller reach: a pair costs some 15 ns at each of the poses that a step looks at.
constexpr std::size_t kFewPairs = 192;
// By how much less than itself a length is, so that rounded to a float it is no more.
constexpr double kOfFloats = std::numeric_limits<float>::epsilon();
// And more triangles than this: one costs some 100 ns whenever pairs are gathered.
constexpr std::size_t kFewFaces = 256;

// Whether the box around two points comes near another one.
bool is_near(const Bounds& box, const Vec3& a, const Vec3& b, double near) noexcept {
  return (a.cwiseMin(b).array() <= box.high.array() + near).all() &&
         (a.cwiseMax(b).array() >= box.low.array() - near).all();
}

}  // namespace

template <typename Add>
void RigidWorld::pairs_with(const Solid& own, const Bounds& own_box, const Solid& other, const Bounds& other_box,
                            const View& at, double reach, Add add) const noexcept {
  const double radii = own.radius + other.radius, near = reach + radii, near2 = near * near;
  const bool round = radii > 0.0;
  const double turn = reach / shared_->reach;
  const NormalCone::Angle corners_turn = turn_of_corners(turn);
  const auto within = [&](double distance2, Kind kind, std::uint32_t i, std::uint32_t j) {
    if (distance2 <= near2) add(kind, i, j, std::sqrt(distance2) - radii);
  };
  for (std::uint32_t i = 0; i < own.points.size(); ++i) {
    const Vec3 p = at * own.points[i];
    if (!is_near(other_box, p, p, near)) continue;
    const NormalCone cone = own.cones.of_corners[i].seen_by(at.R);
    for (std::uint32_t j = 0; j < other.faces.size(); ++j) {
      const Solid::Face& face = other.faces[j];
      if (!cone.holds(-face.normal, other.cones.around_faces[j] + corners_turn)) continue;
      within(distance2_within(other, face, p, near), Kind::point_face, i, j);
    }
    if (!round) continue;
    for (std::uint32_t j = 0; j < other.points.size(); ++j) {
      within((p - other.points[j]).squaredNorm(), Kind::point_point, i, j);
    }
    for (std::uint32_t j = 0; j < other.edges.size(); ++j) {
      within(distance2_to_segment(p, edge_of(other, j)), Kind::point_edge, i, j);
    }
  }
  for (std::uint32_t j = 0; j < other.points.size(); ++j) {
    const Vec3 y = at.to_T(other.points[j]);
    if (!is_near(own_box, y, y, near)) continue;
    const NormalCone cone = other.cones.of_corners[j].seen_by(at.R.transpose());
    for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
      const Solid::Face& face = own.faces[i];
      if (!cone.holds(-face.normal, own.cones.around_faces[i] + corners_turn)) continue;
      within(distance2_within(own, face, y, near), Kind::face_point, i, j);
    }
    if (!round) continue;
    for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
      within(distance2_to_segment(y, edge_of(own, i)), Kind::edge_point, i, j);
    }
  }
  std::array<std::uint16_t, most_edges> near_edges;
  std::size_t count = 0;
  for (std::uint32_t j = 0; j < other.edges.size(); ++j) {
    const Vec3 &from = other.points[other.edges[j].from], &to = other.points[other.edges[j].to];
    if (is_near(own_box, at.to_T(from), at.to_T(to), near)) near_edges[count++] = static_cast<std::uint16_t>(j);
  }
  for (std::uint32_t i = 0; count > 0 && i < own.edges.size(); ++i) {
    const EdgeLine edge = moved_edge(edge_of(own, i), at);
    if (!is_near(other_box, edge.from, edge.to, near)) continue;
    for (const std::uint32_t j : std::span(near_edges).first(count)) {
      const EdgeLine line = edge_of(other, j);
      const double distance2 = distance2_of_segments(edge, line);
      if (distance2 > near2 || (!round && never_hold(edge, line, turn))) continue;
      within(distance2, Kind::edges, i, j);
    }
  }
}

// Which triangles come near a part of the tool, and what of the part comes near them.
class RigidWorld::NearFaces {
 public:
  // Of more triangles than `room` it takes none. The tool is on a body's side of its faces, or on either of an open
  // one.
  NearFaces(const Solid& solid, const Bounds& box_T, const TriangleFeatures& mesh, double side, const View& at,
            double near, double turn, std::size_t room) noexcept
      : solid_(&solid), near_(near), turn_(turn), corners_turn_(turn_of_corners(turn)) {
    const PartBox around(solid, box_T, at, near);
    around.each_face(mesh.mesh(), [&](std::uint32_t face, const Bounds& box) {
      if (count_ == room) return all_ = false;
      faces_[count_++] = face;
      // Beyond the tool's own box nothing of it comes near.
      const Vec3 low = box.low.cwiseMax(around.low_T()), high = box.high.cwiseMin(around.high_T());
      region_.low = count_ == 1 ? low : region_.low.cwiseMin(low);
      region_.high = count_ == 1 ? high : region_.high.cwiseMax(high);
      return true;
    });
    if (count_ == 0 || !all_) return;
    if (side != 0.0 && !(solid.radius > 0.0)) normals_ = cone_around(mesh, side * at.R.transpose());
    for (std::uint32_t i = 0; i < solid_->faces.size(); ++i) {
      if (may_hold(i)) facing_[facing_count_++] = static_cast<std::uint16_t>(i);
    }
    for (std::uint32_t i = 0; i < solid_->edges.size(); ++i) {
      const Vec3 &from = solid_->points[solid_->edges[i].from], &to = solid_->points[solid_->edges[i].to];
      if (!meets(from.cwiseMin(to), from.cwiseMax(to)) || !faces_some(solid_->cones.of_edges[i])) continue;
      around_[crossing_count_] = {0.5 * (from + to), 0.5 * (to - from).norm()};
      crossing_[crossing_count_++] = static_cast<std::uint16_t>(i);
    }
  }

  [[nodiscard]] double near() const noexcept { return near_; }
  [[nodiscard]] double turn() const noexcept { return turn_; }  // of poses to come, rad
  [[nodiscard]] const NormalCone::Angle& corners_turn() const noexcept { return corners_turn_; }
  [[nodiscard]] bool all() const noexcept { return all_; }  // or there is no room for more
  [[nodiscard]] std::span<const std::uint32_t> faces() const noexcept { return {faces_.data(), count_}; }
  // Whether a box of T comes near any of the triangles.
  [[nodiscard]] bool meets(const Vec3& low, const Vec3& high) const noexcept {
    return (low.array() <= region_.high.array() + near_).all() && (high.array() >= region_.low.array() - near_).all();
  }
  // Whether what of the tool has such normals may rest on any of the triangles.
  [[nodiscard]] bool faces_some(const NormalCone& cone) const noexcept {
    return normals_.holds(-cone.axis, cone.half + corners_turn_);
  }
  // The tool's faces that a vertex of the triangles may rest on.
  [[nodiscard]] std::span<const std::uint16_t> facing() const noexcept { return {facing_.data(), facing_count_}; }

  // Calls visit(edge) for the edges whose ball comes near another one.
  template <typename Visit>
  void each_crossing(const Vec3& middle, double radius, Visit visit) const noexcept {
    for (std::size_t i = 0; i < crossing_count_; ++i) {
      const double most = near_ + radius + around_[i].radius;
      if ((around_[i].middle - middle).squaredNorm() <= most * most) visit(crossing_[i]);
    }
  }

  // Whether two points of T, and so all between them, are further than near before one of the tool's faces. What is
  // asked next often is so for the same one.
  [[nodiscard]] bool beyond(const Vec3& y, const Vec3& z) noexcept {
    const auto out = [&](std::size_t i) {
      const Solid::Face& face = solid_->faces[facing_[i]];
      return std::min(face.normal.dot(y), face.normal.dot(z)) - face.offset > near_;
    };
    if (witness_ < facing_count_ && out(witness_)) return true;
    for (std::size_t i = 0; i < facing_count_; ++i) {
      if (!out(i)) continue;
      witness_ = i;
      return true;
    }
    return false;
  }

 private:
  // Whether a vertex of the triangles may rest on a face of the tool, by where the face is and by its normal.
  [[nodiscard]] bool may_hold(std::uint32_t index) const noexcept {
    const Solid::Face& face = solid_->faces[index];
    if (!normals_.holds(-face.normal, solid_->cones.around_faces[index] + corners_turn_)) return false;
    const auto corners = solid_->corners(face);
    Vec3 low = solid_->points[corners.front()], high = low;
    for (const std::uint32_t corner : corners) {
      low = low.cwiseMin(solid_->points[corner]);
      high = high.cwiseMax(solid_->points[corner]);
    }
    return meets(low, high);
  }
  // Around the normals of all triangles and of those that share corners with them.
  [[nodiscard]] NormalCone cone_around(const TriangleFeatures& mesh, const Mat3& to_T) const noexcept {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t face : faces()) sum += face_of(mesh, face).normal;
    const double size = sum.norm();
    NormalCone cone;
    if (!(size > 0.0)) return cone;
    cone.axis = sum / size;
    NormalCone::Angle widest{1.0, 0.0};
    for (const std::uint32_t face : faces()) {
      const NormalCone::Angle half =
          mesh.around(face) + NormalCone::Angle::between(cone.axis, face_of(mesh, face).normal);
      if (half.is_any()) return {};
      if (half.cosine < widest.cosine) widest = half;
    }
    cone.half = widest.narrow();
    return cone.seen_by(to_T);
  }

  struct Ball {
    Vec3 middle;
    double radius;
  };
  const Solid* solid_;
  double near_, turn_;
  NormalCone::Angle corners_turn_;
  Bounds region_;  // in T, of the triangles' part within the tool's box
  std::array<std::uint32_t, most_faces> faces_;
  NormalCone normals_;  // of the triangles, in T
  std::array<std::uint16_t, most_edges> facing_, crossing_;
  std::array<Ball, most_edges> around_;  // those that cross
  std::size_t count_ = 0, facing_count_ = 0, crossing_count_ = 0, witness_ = 0;
  bool all_ = true;
};

// The tool's points.
template <typename Add>
void RigidWorld::points_with(const Solid& own, const TriangleFeatures& other, double side, const NearFaces& close,
                             const View& at, Add add) const noexcept {
  const double near = close.near(), near2 = near * near;
  const auto within = [&](double distance2, Kind kind, std::uint32_t i, std::uint32_t j) {
    if (distance2 <= near2) add(kind, i, j, std::sqrt(distance2) - own.radius);
  };
  for (std::uint32_t i = 0; i < own.points.size(); ++i) {
    if (!close.meets(own.points[i], own.points[i]) || !close.faces_some(own.cones.of_corners[i])) continue;
    const Vec3 p = at * own.points[i];
    const NormalCone cone = own.cones.of_corners[i].seen_by(at.R);
    other.mesh().within(p, near, [&](std::uint32_t face) {
      if (crowded_) return false;
      const double distance2 = distance2_within(other.mesh(), face, p, near);
      if (distance2 > near2) return true;
      const NormalCone::Angle turn = other.around(face) + close.corners_turn();
      const bool may_rest = side == 0.0 || cone.holds(-side * face_of(other, face).normal, turn);
      if (may_rest) within(distance2, Kind::point_face, i, face);
      if (!(own.radius > 0.0)) return true;
      for (const std::uint32_t v : other.vertices_of(face)) {
        within((p - other.vertex(v)).squaredNorm(), Kind::point_point, i, v);
      }
      for (const std::uint32_t e : other.edges_of(face)) {
        within(distance2_to_segment(p, other.edge(e).line), Kind::point_edge, i, e);
      }
      return true;
    });
  }
}

// A vertex of the mesh, at y in T and with its cone there, with the tool's faces and edges.
template <typename Add>
void RigidWorld::vertex_with(const Solid& own, std::uint32_t v, const Vec3& y, const NormalCone& cone, NearFaces& close,
                             Add add) const noexcept {
  const double near = close.near(), near2 = near * near;
  const auto within = [&](double distance2, Kind kind, std::uint32_t i) {
    if (distance2 <= near2) add(kind, i, v, std::sqrt(distance2) - own.radius);
  };
  if (!close.beyond(y, y)) {
    for (const std::uint16_t i : close.facing()) {
      const Solid::Face& face = own.faces[i];
      if (!cone.holds(-face.normal, own.cones.around_faces[i] + close.corners_turn())) continue;
      within(distance2_within(own, face, y, near), Kind::face_point, i);
    }
  }
  if (!(own.radius > 0.0)) return;
  close.each_crossing(y, 0.0,
                      [&](std::uint16_t i) { within(distance2_to_segment(y, edge_of(own, i)), Kind::edge_point, i); });
}

// An edge of the mesh, seen from T, with the tool's edges.
template <typename Add>
void RigidWorld::edge_with(const Solid& own, std::uint32_t e, const EdgeLine& line, NearFaces& close,
                           Add add) const noexcept {
  if (close.beyond(line.from, line.to)) return;
  const Vec3 middle = 0.5 * (line.from + line.to);
  const double half = 0.5 * (line.to - line.from).norm();
  close.each_crossing(middle, half, [&](std::uint16_t i) {
    const EdgeLine edge = edge_of(own, i);
    const double distance2 = distance2_of_segments(edge, line);
    if (distance2 > close.near() * close.near()) return;
    if (!(own.radius > 0.0) && never_hold(edge, line, close.turn())) return;
    add(Kind::edges, i, e, std::sqrt(distance2) - own.radius);
  });
}

template <typename Add>
void RigidWorld::pairs_with(const Solid& own, const Bounds& box, const TriangleFeatures& other, double side,
                            const View& at, double reach, Add add) noexcept {
  NearFaces close(own, box, other, side, at, reach + own.radius, reach / shared_->reach, face_room_);
  crowded_ = crowded_ || !close.all();
  if (!close.all() || close.faces().empty()) return;
  near_faces_ += close.faces().size();
  points_with(own, other, side, close, at, add);
  if (own.edges.empty()) return;
  // Inside of a body its normals are the others.
  const Mat3 to_T = (side < 0.0 ? -1.0 : 1.0) * at.R.transpose();
  for (const std::uint32_t face : close.faces()) {
    if (crowded_) return;
    for (const std::uint32_t v : other.vertices_of(face)) {
      vertex_with(own, v, at.to_T(other.vertex(v)), other.cone(v).seen_by(to_T), close, add);
    }
    for (const std::uint32_t e : other.edges_of(face)) {
      const TriangleFeatures::Edge& edge = other.edge(e);
      // A valley of a closed mesh is touched by nothing sharp.
      const bool is_valley = side != 0.0 && !edge.line.open && edge.ridge != (side > 0.0);
      if (is_valley && !(own.radius > 0.0)) continue;
      edge_with(own, e, edge_in_T(edge.line, at, edge.ridge ? 1.0 : -1.0), close, add);
    }
  }
}

void RigidWorld::add_pair(Kind kind, std::uint16_t part, std::uint16_t entry, std::uint32_t own, std::uint32_t other,
                          double apart_m) noexcept {
  if (pair_count_ == pair_room_) {
    crowded_ = true;
    return;
  }
  Pair& pair = pairs_[pair_count_++];
  pair = {};
  pair.kind = kind;
  pair.part = part;
  pair.entry = entry;
  pair.own = own;
  pair.other = other;
  pair.apart_m = static_cast<float>(apart_m * (1.0 - kOfFloats));
}

// Of a pair whose features have changed places.
RigidWorld::Kind RigidWorld::other_way_round(Kind kind) noexcept {
  switch (kind) {
    case Kind::point_face:
      return Kind::face_point;
    case Kind::face_point:
      return Kind::point_face;
    case Kind::point_edge:
      return Kind::edge_point;
    case Kind::edge_point:
      return Kind::point_edge;
    default:
      return kind;
  }
}

void RigidWorld::gather_part(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const Entry& e = shared_->entries[entry];
  const Part& own = shared_->parts[part];
  const auto add = [&](Kind kind, std::uint32_t i, std::uint32_t j, double apart_m) {
    add_pair(kind, part, entry, i, j, apart_m);
  };
  const Solid* solid = std::get_if<Solid>(&e.object.shape);
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape);
  if (e.cylinder || (own.cylinder && (mesh != nullptr || solid != nullptr))) {
    return gather_cylinder(part, entry, at, reach);
  }
  if (mesh != nullptr) {
    if (own.mesh) return gather_meshes(part, entry, at, reach);
    return pairs_with(own.solid, own.box, **mesh, e.held, at, reach, add);
  }
  if (solid != nullptr) {
    if (!own.mesh) return pairs_with(own.solid, own.box, *solid, e.box, at, reach, add);
    // Seen from the tool it is a solid near a mesh.
    return pairs_with(*solid, e.box, *own.mesh, 1.0, inverse(at), reach,
                      [&](Kind kind, std::uint32_t i, std::uint32_t j, double apart_m) {
                        add(other_way_round(kind), j, i, apart_m);
                      });
  }
  with_flat_or_hollow(e.object, [&](const auto& shape) {
    for (std::uint32_t i = 0; i < own.solid.points.size(); ++i) {
      const double gap = touch(shape, at * own.solid.points[i], own.solid.radius).gap;
      if (gap <= reach) add(Kind::point_field, i, 0, gap);
    }
    for (std::uint32_t i = 0; i < own.solid.rims.size(); ++i) {
      const Solid::Rim& rim = own.solid.rims[i];
      if (touch(shape, at * rim.centre, rim.radius).gap <= reach) add(Kind::rim_field, i, 0, 0.0);
    }
  });
}

// By the ball around a part.
bool RigidWorld::may_reach(const Part& part, const Entry& entry, const View& at, double reach) const noexcept {
  if (!part.box.finite()) return true;
  const double near = 0.5 * (part.box.high - part.box.low).norm() + part.solid.radius + reach;
  return distance2_to_box(at * Vec3(0.5 * (part.box.low + part.box.high)), entry.bounds) <= near * near;
}

void RigidWorld::gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept {
  const Entry& e = shared_->entries[entry];
  const View at = seen_from(entry, view(pose));
  const double around = shared_->reach + reach;
  if (distance2_to_box(at.x, e.bounds) > around * around) return;
  for (std::size_t i = 0; i < shared_->parts.size() && !crowded_; ++i) {
    if (!may_reach(shared_->parts[i], e, at, reach)) continue;
    gather_part(static_cast<std::uint16_t>(i), entry, at, reach);
  }
}

// As far around as steps like this one need for a while; among many triangles only as far as this one needs, since each
// pair costs in every step, and each triangle in every gathering. That is one and a half times its way, in three parts
// of a quarter of the reach: in two, of three times its way, a hull's slowest steps took nearly twice as long, and a
// mesh's too. Where even those don't find room, the step is taken in parts that need less.
void RigidWorld::gather_for(const ToolPose& q, double far) noexcept {
  const double least = 1.5 * far + 1e-6;
  double reach = 3.0 * far + std::max(8.0 * far, 0.01 * shared_->reach) + 1e-6;
  const bool dense = shared_->dense;
  if (dense && gathered_reach_ > 0.0) {
    const bool few = pair_count_ < kFewPairs / 4 && near_faces_ < kFewFaces / 4;
    reach = std::clamp((few ? 2.0 : 1.0) * gathered_reach_, least, reach);
  }
  const KeptPairs kept = pressed_pairs();
  for (; reach > 1.5 * least; reach *= 0.5) {
    if (look_around(q, reach, dense ? kFewPairs : most_pairs, dense ? kFewFaces : most_faces)) return restore(kept);
  }
  reach = least;
  for (int k = 0; k < 10 && !look_around(q, reach); ++k) reach *= 0.5;
  restore(kept);
}

void RigidWorld::gather(const ToolPose& pose, double reach) noexcept {
  const KeptPairs kept = pressed_pairs();
  look_around(pose, reach);
  restore(kept);
}

// Whether there was room for all pairs and for the triangles they are of; otherwise it ends early.
bool RigidWorld::look_around(const ToolPose& pose, double reach, std::size_t pairs, std::size_t faces) noexcept {
  pair_room_ = pairs;
  face_room_ = faces;
  pair_count_ = pressed_count_ = near_faces_ = 0;
  crowded_ = false;
  list_leaves(pose, reach);
  for (std::size_t entry = 0; entry < shared_->first_moving; ++entry) {
    gather_entry(static_cast<std::uint16_t>(entry), pose, reach);
  }
  still_count_ = pair_count_;
  for (std::size_t entry = shared_->first_moving; entry < shared_->entries.size(); ++entry) {
    gather_entry(static_cast<std::uint16_t>(entry), pose, reach);
    Moving& m = moving(static_cast<std::uint16_t>(entry));
    m.gathered = m.mover.at().back(pose);
  }
  gathered_at_ = pose;
  gathered_reach_ = reach;
  return !crowded_;
}

// The sides and forces of what touched are kept when pairs are gathered anew.
RigidWorld::KeptPairs RigidWorld::pressed_pairs() const noexcept {
  KeptPairs kept;
  for (std::size_t i = 0; i < pair_count_ && kept.count < kept.pairs.size(); ++i) {
    if (pairs_[i].pressed) kept.pairs[kept.count++] = pairs_[i];
  }
  return kept;
}

void RigidWorld::restore(const KeptPairs& kept) noexcept {
  for (std::size_t k = 0; k < kept.count; ++k) {
    const Pair& old = kept.pairs[k];
    for (std::size_t i = 0; i < pair_count_; ++i) {
      Pair& pair = pairs_[i];
      if (pair.kind != old.kind || pair.part != old.part || pair.entry != old.entry) continue;
      if (pair.own != old.own || pair.other != old.other) continue;
      const float apart_m = pair.apart_m;
      pair = old;
      pair.apart_m = apart_m;
    }
  }
}

}  // namespace proxarm::models
