// Finds the pairs of features that may meet: of two convex solids, or of a convex solid and a mesh.
//
// Each pair is passed to add(kind, feature of the first body, feature of the second body, lower bound of their distance
// in m).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "models/rigid_bodies/pair.hpp"
#include "models/rigid_bodies/rigid_setup.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/near_faces.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Finds the pairs of a solid of the tool and a solid object, in the object's frame. `turn`: by how much the tool may
// turn in the steps to come, rad.
template <typename Add>
class PairsOfSolids {
 public:
  PairsOfSolids(const RigidPart& own, const RigidEntry& other, const View& at, double reach, double turn,
                Add add) noexcept
      : own_(own.solid),
        other_(*other.solid()),
        own_box_(own.box),
        other_box_(other.box),
        at_(at),
        radii_(own_.radius + other_.radius),
        near_(reach + radii_),
        turn_(turn),
        corners_turn_(turn_of_corners(turn)),
        add_(add) {}

  void add_all() const noexcept {
    for (std::uint32_t i = 0; i < own_.points.size(); ++i) own_point(i);
    for (std::uint32_t j = 0; j < other_.points.size(); ++j) other_point(j);
    edges();
  }

 private:
  void within(double distance2, PairKind kind, std::uint32_t i, std::uint32_t j) const noexcept {
    if (distance2 <= near_ * near_) add_(kind, i, j, std::sqrt(distance2) - radii_);
  }
  // Whether the box around the points a and b comes near `box`.
  [[nodiscard]] bool is_near(const Bounds& box, const Vec3& a, const Vec3& b) const noexcept {
    return (a.cwiseMin(b).array() <= box.high.array() + near_).all() &&
           (a.cwiseMax(b).array() >= box.low.array() - near_).all();
  }
  void own_point(std::uint32_t i) const noexcept {
    const Vec3 p = at_ * own_.points[i];
    if (!is_near(other_box_, p, p)) return;
    const NormalCone cone = own_.cones.of_corners[i].seen_by(at_.R);
    for (std::uint32_t j = 0; j < other_.faces.size(); ++j) {
      const Solid::Face& face = other_.faces[j];
      if (!cone.holds(-face.normal, other_.cones.around_faces[j] + corners_turn_)) continue;
      within(distance2_within(other_, face, p, near_), PairKind::point_face, i, j);
    }
    if (!(radii_ > 0.0)) return;
    for (std::uint32_t j = 0; j < other_.points.size(); ++j) {
      within((p - other_.points[j]).squaredNorm(), PairKind::point_point, i, j);
    }
    for (std::uint32_t j = 0; j < other_.edges.size(); ++j) {
      within(distance2_to_segment(p, edge_of(other_, j)), PairKind::point_edge, i, j);
    }
  }
  void other_point(std::uint32_t j) const noexcept {
    const Vec3 y = at_.to_T(other_.points[j]);
    if (!is_near(own_box_, y, y)) return;
    const NormalCone cone = other_.cones.of_corners[j].seen_by(at_.R.transpose());
    for (std::uint32_t i = 0; i < own_.faces.size(); ++i) {
      const Solid::Face& face = own_.faces[i];
      if (!cone.holds(-face.normal, own_.cones.around_faces[i] + corners_turn_)) continue;
      within(distance2_within(own_, face, y, near_), PairKind::face_point, i, j);
    }
    if (!(radii_ > 0.0)) return;
    for (std::uint32_t i = 0; i < own_.edges.size(); ++i) {
      within(distance2_to_segment(y, edge_of(own_, i)), PairKind::edge_point, i, j);
    }
  }
  void edges() const noexcept {
    std::array<std::uint16_t, NearFaces::most_edges> near_edges;
    std::size_t count = 0;
    for (std::uint32_t j = 0; j < other_.edges.size(); ++j) {
      const Vec3 &from = other_.points[other_.edges[j].from], &to = other_.points[other_.edges[j].to];
      if (is_near(own_box_, at_.to_T(from), at_.to_T(to))) near_edges[count++] = static_cast<std::uint16_t>(j);
    }
    const bool round = radii_ > 0.0;
    for (std::uint32_t i = 0; count > 0 && i < own_.edges.size(); ++i) {
      const EdgeLine edge = moved_edge(edge_of(own_, i), at_);
      if (!is_near(other_box_, edge.from, edge.to)) continue;
      for (const std::uint32_t j : std::span(near_edges).first(count)) {
        const EdgeLine line = edge_of(other_, j);
        const double distance2 = distance2_of_segments(edge, line);
        if (distance2 > near_ * near_ || (!round && never_hold(edge, line, turn_))) continue;
        within(distance2, round ? PairKind::round_edges : PairKind::edges, i, j);
      }
    }
  }

  const Solid &own_, &other_;
  const Bounds &own_box_, &other_box_;
  const View& at_;
  double radii_, near_, turn_;
  NormalCone::Angle corners_turn_;
  Add add_;
};

// Finds the pairs of a solid and a mesh, in the mesh's frame. `side`: the side of the mesh's faces that is touched, 1
// or −1; 0 if both sides are. `crowded` is read before each triangle; if it is true, the search ends.
template <typename Add>
class PairsWithMesh {
 public:
  PairsWithMesh(const Solid& solid, const TriangleFeatures& mesh, double side, const View& at, NearFaces& close,
                const bool& crowded, Add add) noexcept
      : solid_(solid), mesh_(mesh), side_(side), at_(at), close_(close), crowded_(crowded), add_(add) {}

  void add_all() noexcept {
    for (std::uint32_t i = 0; i < solid_.points.size(); ++i) solid_corner(i);
    if (solid_.edges.empty()) return;
    // If a closed mesh is touched on the back of its faces, all normals are reversed.
    const Mat3 to_T = (side_ < 0.0 ? -1.0 : 1.0) * at_.R.transpose();
    for (const std::uint32_t face : close_.faces()) {
      if (crowded_) return;
      for (const std::uint32_t v : mesh_.vertices_of(face)) vertex(v, to_T, at_.to_T(mesh_.vertex(v)));
      for (const std::uint32_t e : mesh_.edges_of(face)) {
        const TriangleFeatures::Edge& edge = mesh_.edge(e);
        // No sharp feature can touch a valley of a closed mesh.
        const bool is_valley = side_ != 0.0 && !edge.line.open && edge.ridge != (side_ > 0.0);
        if (is_valley && !(solid_.radius > 0.0)) continue;
        edge_of_mesh(e);
      }
    }
  }

 private:
  void within(double distance2, PairKind kind, std::uint32_t i, std::uint32_t j) const noexcept {
    const double near = close_.near();
    if (distance2 <= near * near) add_(kind, i, j, std::sqrt(distance2) - solid_.radius);
  }
  void solid_corner(std::uint32_t i) const noexcept {
    if (!close_.meets(solid_.points[i], solid_.points[i]) || !close_.faces_some(solid_.cones.of_corners[i])) return;
    const Vec3 p = at_ * solid_.points[i];
    const NormalCone cone = solid_.cones.of_corners[i].seen_by(at_.R);
    const double near = close_.near();
    mesh_.mesh().within(p, near, [&](std::uint32_t face) {
      if (crowded_) return false;
      const double distance2 = distance2_within(mesh_.mesh(), face, p, near);
      if (distance2 > near * near) return true;
      const NormalCone::Angle turn = mesh_.around(face) + close_.corners_turn();
      const bool may_rest = side_ == 0.0 || cone.holds(-side_ * face_of(mesh_, face).normal, turn);
      if (may_rest) within(distance2, PairKind::point_face, i, face);
      if (!(solid_.radius > 0.0)) return true;
      for (const std::uint32_t v : mesh_.vertices_of(face)) {
        within((p - mesh_.vertex(v)).squaredNorm(), PairKind::point_point, i, v);
      }
      for (const std::uint32_t e : mesh_.edges_of(face)) {
        within(distance2_to_segment(p, mesh_.edge(e).line), PairKind::point_edge, i, e);
      }
      return true;
    });
  }
  // Adds the pairs of a vertex of the mesh, at y in T, with the solid's faces and edges.
  void vertex(std::uint32_t v, const Mat3& to_T, const Vec3& y) noexcept {
    if (!close_.beyond(y)) {
      const NormalCone cone = mesh_.cone(v).seen_by(to_T);
      for (const std::uint16_t i : close_.facing()) {
        const Solid::Face& face = solid_.faces[i];
        if (!(std::abs(face.normal.dot(y) - face.offset) <= close_.near())) continue;
        if (!cone.holds(-face.normal, solid_.cones.around_faces[i] + close_.corners_turn())) continue;
        within(distance2_within(solid_, face, y, close_.near()), PairKind::face_point, i, v);
      }
    }
    if (!(solid_.radius > 0.0)) return;
    close_.each_crossing(y, y, [&](std::uint16_t i) {
      within(distance2_to_segment(y, edge_of(solid_, i)), PairKind::edge_point, i, v);
    });
  }
  // Adds the pairs of an edge of the mesh with the solid's edges.
  void edge_of_mesh(std::uint32_t e) noexcept {
    const TriangleFeatures::Edge& of_mesh = mesh_.edge(e);
    const Vec3 from = at_.to_T(of_mesh.line.from), to = at_.to_T(of_mesh.line.to);
    if (close_.beyond_last(from, to)) return;
    std::optional<EdgeLine> line;  // the edge in T; computed only when needed, because for most edges the ends suffice
    close_.each_crossing(from.cwiseMin(to), from.cwiseMax(to), [&](std::uint16_t i) {
      if (!line) line = edge_in_T(of_mesh.line, at_, of_mesh.ridge ? 1.0 : -1.0);
      const EdgeLine edge = edge_of(solid_, i);
      const double distance2 = distance2_of_segments(edge, *line);
      if (distance2 > close_.near() * close_.near()) return;
      if (!(solid_.radius > 0.0) && never_hold(edge, *line, close_.turn())) return;
      add_(solid_.radius > 0.0 ? PairKind::round_edges : PairKind::edges, i, e, std::sqrt(distance2) - solid_.radius);
    });
  }

  const Solid& solid_;
  const TriangleFeatures& mesh_;
  double side_;
  const View& at_;
  NearFaces& close_;
  const bool& crowded_;
  Add add_;
};

}  // namespace proxarm::models
