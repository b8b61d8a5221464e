// On which side of a feature the tool is when a step, or a part of it, begins.
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Of a pair at q(k−1): the height of the tool's feature over the object's, or of the object's point over the tool's
// face.
double RigidWorld::signed_start(const Pair& pair, const View& at) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* solid = std::get_if<Solid>(&object.shape);
  if (pair.kind == Kind::point_face) {
    const Vec3 p = at * own.points[pair.own];
    if (mesh != nullptr) return TriangleMesh::height(face_of(**mesh, pair.other), p);
    const Solid::Face& face = solid->faces[pair.other];
    return face.normal.dot(p) - face.offset;
  }
  if (pair.kind == Kind::face_point) {
    const Vec3& p = mesh != nullptr ? (*mesh)->vertex(pair.other) : solid->points[pair.other];
    const Solid::Face& face = own.faces[pair.own];
    return face.normal.dot(at.R.transpose() * (p - at.x)) - face.offset;
  }
  const EdgeLine a = own_edge(pair), b = other_edge(pair);
  Vec3 n = (at.R * (a.to - a.from)).cross(b.to - b.from);
  const double size = n.norm();
  if (!(size > 1e-7 * (a.to - a.from).norm() * (b.to - b.from).norm())) return 0.0;
  n /= size;
  if (!b.open) {
    const double outwards = mesh != nullptr && !(*mesh)->edge(pair.other).ridge ? -1.0 : 1.0;
    if (outwards * n.dot(b.left + b.right) < 0.0) n = -n;
  }
  return n.dot(at * a.from - b.from);
}

void RigidWorld::set_sides(const ToolPose& q_old, double far) noexcept {
  from_ = q_old;
  behind_m_ = 2.0 * far + kFront_m;
  const View at_W = view(q_old);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    moving_[i].from = seen_from(static_cast<std::uint16_t>(shared_->first_moving + i), at_W);
  }
  for (std::size_t i = 0; i < pair_count_; ++i) {
    Pair& pair = pairs_[i];
    pair.barred = false;
    if (pair.kind != Kind::point_face && pair.kind != Kind::face_point && pair.kind != Kind::edges) continue;
    const View& at = i < still_count_ ? at_W : moving(pair.entry).from;
    const RigidObject& object = shared_->entries[pair.entry].object;
    const bool is_mesh = std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(object.shape);
    const double height = signed_start(pair, at);
    // (What pressed in a part that led nowhere may have lost its side there.)
    const bool near = pair.pressed && pair.side != 0.0F && std::abs(height) < kFront_m;
    if (pair.kind == Kind::face_point) {
      if (!near) pair.side = static_cast<float>(side_of_tools_face(pair, at, height, far));
    } else if (!is_mesh && pair.kind == Kind::point_face) {
      if (!near) pair.side = static_cast<float>(side_of_solids_face(pair, at, height, far));
    } else if (!is_mesh) {
      pair.side = height >= -2.0 * far - kFront_m ? 1.0F : 0.0F;
    } else if (!near) {
      pair.side = static_cast<float>(side_of_mesh(pair, at, height, far));
    }
  }
}

// A point under a face of a closed body that it has not come through: in front of it, or behind, as beside an edge,
// where its foot isn't on the face. Under the face it is behind the body's far side, which next to an edge is near,
// however thick the body is.
double RigidWorld::side_of_tools_face(const Pair& pair, const View& at, double height, double far) const noexcept {
  if (height >= -kFront_m) return 1.0;
  if (height < -2.0 * far - kFront_m) return 0.0;
  const Solid& own = shared_->parts[pair.part].solid;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Vec3 y =
      at.to_T(mesh != nullptr ? (*mesh)->vertex(pair.other) : std::get_if<Solid>(&object.shape)->points[pair.other]);
  const Solid::Face& face = own.faces[pair.own];
  return touch_face(y, 0.0, face.normal, face.offset, own.points, own.corners(face), 1.0).has_value() ? 0.0 : 1.0;
}

// The same for the tool's point under a face of a solid.
double RigidWorld::side_of_solids_face(const Pair& pair, const View& at, double height, double far) const noexcept {
  if (height >= -kFront_m) return 1.0;
  if (height < -2.0 * far - kFront_m) return 0.0;
  const Solid& solid = *std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  const Solid::Face& face = solid.faces[pair.other];
  const Vec3 p = at * shared_->parts[pair.part].solid.points[pair.own];
  return touch_face(p, 0.0, face.normal, face.offset, solid.points, solid.corners(face), 1.0).has_value() ? 0.0 : 1.0;
}

// A closed mesh holds the tool on its side, an open one on that on which the feature is. A feature may have been behind
// without having come through, as beside an edge: its foot wasn't on the face then.
double RigidWorld::side_of_mesh(const Pair& pair, const View& at, double height, double far) const noexcept {
  const auto& mesh = **std::get_if<std::shared_ptr<const TriangleFeatures>>(&shared_->entries[pair.entry].object.shape);
  const double held = shared_->entries[pair.entry].held;
  if (pair.kind == Kind::point_face) {
    if (held == 0.0) return height < 0.0 ? -1.0 : 1.0;
    if (held * height >= -kFront_m) return held;
    if (held * height < -2.0 * far - kFront_m) return 0.0;
    const Vec3 p = at * shared_->parts[pair.part].solid.points[pair.own];
    return touch_face(p, 0.0, face_of(mesh, pair.other).normal, 0.0, mesh.mesh().structure().vertices,
                      mesh.mesh().triangle(pair.other), 1.0)
                   .has_value()
               ? 0.0
               : held;
  }
  if (pair.kind == Kind::edges) {
    const TriangleFeatures::Edge& edge = mesh.edge(pair.other);
    if (edge.line.open) return height < 0.0 ? -1.0 : 1.0;
    if (held != 0.0 && edge.ridge != (held > 0.0)) return 0.0;
  }
  return height >= -2.0 * far - kFront_m ? 1.0 : 0.0;
}

// Whether a tool's point that is on the other side of a face than at the beginning has come through the face: the place
// where its way meets the plane is on the triangle. It may have come around.
bool RigidWorld::crossed(const Pair& pair, const Vec3& p) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const auto& mesh = **std::get_if<std::shared_ptr<const TriangleFeatures>>(&shared_->entries[pair.entry].object.shape);
  const TriangleMesh::Face& face = face_of(mesh, pair.other);
  const Vec3 was = (moves(pair.entry) ? moving(pair.entry).from : view(from_)) * own.points[pair.own];
  const double before = TriangleMesh::height(face, was), after = TriangleMesh::height(face, p);
  if (pair.pressed || before * after >= 0.0) return true;
  const Vec3 there = was + before / (before - after) * (p - was);
  return touch_face(there, 0.0, face.normal, 0.0, mesh.mesh().structure().vertices, mesh.mesh().triangle(pair.other),
                    1.0)
      .has_value();
}

}  // namespace proxarm::models
