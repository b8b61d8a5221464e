// Which pairs of features may meet in the steps to come.
#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/near_faces.hpp"
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
      within(distance2, round ? Kind::round_edges : Kind::edges, i, j);
    }
  }
}

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

// A vertex of the mesh, at y in T, with the tool's faces and edges.
template <typename Add>
void RigidWorld::vertex_with(const Solid& own, const TriangleFeatures& other, std::uint32_t v, const Mat3& to_T,
                             const Vec3& y, NearFaces& close, Add add) const noexcept {
  const double near = close.near(), near2 = near * near;
  const auto within = [&](double distance2, Kind kind, std::uint32_t i) {
    if (distance2 <= near2) add(kind, i, v, std::sqrt(distance2) - own.radius);
  };
  if (!close.beyond(y)) {
    const NormalCone cone = other.cone(v).seen_by(to_T);
    for (const std::uint16_t i : close.facing()) {
      const Solid::Face& face = own.faces[i];
      if (!(std::abs(face.normal.dot(y) - face.offset) <= near)) continue;
      if (!cone.holds(-face.normal, own.cones.around_faces[i] + close.corners_turn())) continue;
      within(distance2_within(own, face, y, near), Kind::face_point, i);
    }
  }
  if (!(own.radius > 0.0)) return;
  close.each_crossing(y, y,
                      [&](std::uint16_t i) { within(distance2_to_segment(y, edge_of(own, i)), Kind::edge_point, i); });
}

// An edge of the mesh with the tool's edges.
template <typename Add>
void RigidWorld::edge_with(const Solid& own, const TriangleFeatures& other, std::uint32_t e, const View& at,
                           NearFaces& close, Add add) const noexcept {
  const TriangleFeatures::Edge& of_mesh = other.edge(e);
  const Vec3 from = at.to_T(of_mesh.line.from), to = at.to_T(of_mesh.line.to);
  if (close.beyond_last(from, to)) return;
  std::optional<EdgeLine> line;  // in T; few edges are asked for more than their ends
  close.each_crossing(from.cwiseMin(to), from.cwiseMax(to), [&](std::uint16_t i) {
    if (!line) line = edge_in_T(of_mesh.line, at, of_mesh.ridge ? 1.0 : -1.0);
    const EdgeLine edge = edge_of(own, i);
    const double distance2 = distance2_of_segments(edge, *line);
    if (distance2 > close.near() * close.near()) return;
    if (!(own.radius > 0.0) && never_hold(edge, *line, close.turn())) return;
    add(own.radius > 0.0 ? Kind::round_edges : Kind::edges, i, e, std::sqrt(distance2) - own.radius);
  });
}

// Of what stands still. False: no triangle is near, or too many are.
bool RigidWorld::list_triangles(std::uint16_t part, std::uint16_t entry, const NearFaces& close) noexcept {
  crowded_ = crowded_ || !close.all();
  if (!close.all()) return false;
  near_faces_ += close.faces().size();
  if (!moves(entry) && near_triangles_.all()) {
    near_triangles_.begin_with(part, entry);
    for (const std::uint32_t face : close.faces()) near_triangles_.add(face);
  }
  return !close.faces().empty();
}

template <typename Add>
void RigidWorld::pairs_with(const Solid& own, const TriangleFeatures& other, double side, const View& at,
                            NearFaces& close, Add add) noexcept {
  points_with(own, other, side, close, at, add);
  if (own.edges.empty()) return;
  // Inside of a body its normals are the others.
  const Mat3 to_T = (side < 0.0 ? -1.0 : 1.0) * at.R.transpose();
  for (const std::uint32_t face : close.faces()) {
    if (crowded_) return;
    for (const std::uint32_t v : other.vertices_of(face)) {
      vertex_with(own, other, v, to_T, at.to_T(other.vertex(v)), close, add);
    }
    for (const std::uint32_t e : other.edges_of(face)) {
      const TriangleFeatures::Edge& edge = other.edge(e);
      // A valley of a closed mesh is touched by nothing sharp.
      const bool is_valley = side != 0.0 && !edge.line.open && edge.ridge != (side > 0.0);
      if (is_valley && !(own.radius > 0.0)) continue;
      edge_with(own, other, e, at, close, add);
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
  const double turn = reach / shared_->reach;
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
    NearFaces close(own.solid, own.box, **mesh, e.held, at, reach, turn, face_room_);
    if (list_triangles(part, entry, close)) pairs_with(own.solid, **mesh, e.held, at, close, add);
    return;
  }
  if (solid != nullptr) {
    if (!own.mesh) return pairs_with(own.solid, own.box, *solid, e.box, at, reach, add);
    // Seen from the tool it is a solid near a mesh.
    const View from_tool = inverse(at);
    NearFaces close(*solid, e.box, *own.mesh, 1.0, from_tool, reach, turn, face_room_);
    if (!list_triangles(part, entry, close)) return;
    return pairs_with(*solid, *own.mesh, 1.0, from_tool, close,
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
  if (near_triangles_.has_room()) near_triangles_.begin(pose, reach);
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
