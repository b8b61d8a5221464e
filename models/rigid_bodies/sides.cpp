#include "models/rigid_bodies/sides.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

bool is_behind_reach(double height, double far) noexcept { return height < -2.0 * far - kFront_m; }

// Returns the side for a point of an object and a face of the tool:
// 1: The point is in front of the face. Or it is behind the face and its foot lies beside the face, for instance beyond
// an edge.
// 0: The point is too far behind the face. Or it is behind the face and its foot lies on the face; the point then came
// from the body's far side. (Next to an edge the far side is near, however thick the body is.)
double side_of_tools_face(const RigidBodies& bodies, const Pair& pair, const View& at, double height,
                          double far) noexcept {
  if (height >= -kFront_m) return 1.0;
  if (is_behind_reach(height, far)) return 0.0;
  const Solid& own = bodies.part(pair).solid;
  const Vec3 y = at.to_T(bodies.other_point(pair));
  const Solid::Face& face = own.faces[pair.own];
  return touch_face(y, 0.0, face.normal, face.offset, own.points, own.corners(face), 1.0).has_value() ? 0.0 : 1.0;
}

// Returns the same for a point of the tool and a face of a solid object.
double side_of_solids_face(const RigidBodies& bodies, const Pair& pair, const View& at, double height,
                           double far) noexcept {
  if (height >= -kFront_m) return 1.0;
  if (is_behind_reach(height, far)) return 0.0;
  const Solid& solid = *bodies.entry(pair).solid();
  const Solid::Face& face = solid.faces[pair.other];
  const Vec3 p = at * bodies.part(pair).solid.points[pair.own];
  return touch_face(p, 0.0, face.normal, face.offset, solid.points, solid.corners(face), 1.0).has_value() ? 0.0 : 1.0;
}

// Returns the side for a mesh; 0 if the pair isn't judged. A closed mesh holds the tool on one fixed side. An open mesh
// holds the tool on the side on which the tool's feature is.
double side_of_mesh(const RigidBodies& bodies, const Pair& pair, const View& at, double height, double far) noexcept {
  const TriangleFeatures& mesh = *bodies.entry(pair).mesh();
  const double held = bodies.entry(pair).held;
  if (pair.kind == PairKind::point_face) {
    if (held == 0.0) return height < 0.0 ? -1.0 : 1.0;
    if (held * height >= -kFront_m) return held;
    if (is_behind_reach(held * height, far)) return 0.0;
    const Vec3 p = at * bodies.part(pair).solid.points[pair.own];
    return touch_face(p, 0.0, face_of(mesh, pair.other).normal, 0.0, mesh.mesh().structure().vertices,
                      mesh.mesh().triangle(pair.other), 1.0)
                   .has_value()
               ? 0.0
               : held;
  }
  if (pair.kind == PairKind::edges) {
    const TriangleFeatures::Edge& edge = mesh.edge(pair.other);
    if (edge.line.open) return height < 0.0 ? -1.0 : 1.0;
    if (held != 0.0 && edge.ridge != (held > 0.0)) return 0.0;
  }
  return is_behind_reach(height, far) ? 0.0 : 1.0;
}

}  // namespace

double signed_height_m(const RigidBodies& bodies, const Pair& pair, const View& at) noexcept {
  const Solid& own = bodies.part(pair).solid;
  const TriangleFeatures* mesh = bodies.entry(pair).mesh();
  if (pair.kind == PairKind::point_face) {
    const Vec3 p = at * own.points[pair.own];
    if (mesh != nullptr) return TriangleMesh::height(face_of(*mesh, pair.other), p);
    const Solid::Face& face = bodies.entry(pair).solid()->faces[pair.other];
    return face.normal.dot(p) - face.offset;
  }
  if (pair.kind == PairKind::face_point) {
    const Vec3& p = bodies.other_point(pair);
    const Solid::Face& face = own.faces[pair.own];
    return face.normal.dot(at.R.transpose() * (p - at.x)) - face.offset;
  }
  const EdgeLine a = bodies.own_edge(pair), b = bodies.other_edge(pair);
  Vec3 n = (at.R * (a.to - a.from)).cross(b.to - b.from);
  const double size = n.norm();
  if (!(size > 1e-7 * (a.to - a.from).norm() * (b.to - b.from).norm())) return 0.0;
  n /= size;
  if (!b.open) {
    const double outwards = mesh != nullptr && !mesh->edge(pair.other).ridge ? -1.0 : 1.0;
    if (outwards * n.dot(b.left + b.right) < 0.0) n = -n;
  }
  return n.dot(at * a.from - b.from);
}

void Sides::take(RigidBodies& bodies, std::span<Pair> pairs, const ToolPose& q, double far_m) noexcept {
  from_ = q;
  reach_m_ = 2.0 * far_m + kFront_m;
  const View at_W = view(q);
  const auto first_moving = static_cast<std::uint16_t>(bodies.setup().first_moving);
  for (std::uint16_t i = 0; i < bodies.moving().size(); ++i) {
    bodies.moving()[i].from = bodies.seen_from(static_cast<std::uint16_t>(first_moving + i), at_W);
  }
  for (Pair& pair : pairs) {
    pair.barred = false;
    if (!is_point_and_face(pair.kind) && pair.kind != PairKind::edges) continue;
    const View& at = bodies.moves(pair.entry) ? bodies.moving(pair.entry).from : at_W;
    const bool is_mesh = bodies.entry(pair).mesh() != nullptr;
    const double height = signed_height_m(bodies, pair, at);
    // A pair that pressed keeps its side, unless the side became 0 in a part of the step without a solution.
    const bool near = pair.pressed && pair.side != 0.0F && std::abs(height) < kFront_m;
    if (pair.kind == PairKind::face_point) {
      if (!near) pair.side = static_cast<float>(side_of_tools_face(bodies, pair, at, height, far_m));
    } else if (!is_mesh && pair.kind == PairKind::point_face) {
      if (!near) pair.side = static_cast<float>(side_of_solids_face(bodies, pair, at, height, far_m));
    } else if (!is_mesh) {
      pair.side = is_behind_reach(height, far_m) ? 0.0F : 1.0F;
    } else if (!near) {
      pair.side = static_cast<float>(side_of_mesh(bodies, pair, at, height, far_m));
    }
  }
}

View Sides::tool_at_start(const RigidBodies& bodies, const Pair& pair) const noexcept {
  return bodies.moves(pair.entry) ? bodies.moving(pair.entry).from : view(from_);
}

double Sides::came_m(const RigidBodies& bodies, const ToolPose& pose) const noexcept {
  double most = bodies.has_carrier() ? 0.0 : bodies.motion_m(pose, from_);
  for (const MovingEntry& m : bodies.moving()) {
    if (!m.close) continue;
    most = std::max(most, bodies.motion_m(m.mover.at().back(pose), {m.from.x, Quaternion(m.from.R)}));
  }
  return most;
}

bool Sides::went_through(const RigidBodies& bodies, const Pair& pair, const Vec3& p) const noexcept {
  const Solid& own = bodies.part(pair).solid;
  const TriangleFeatures& mesh = *bodies.entry(pair).mesh();
  const TriangleMesh::Face& face = face_of(mesh, pair.other);
  const Vec3 was = tool_at_start(bodies, pair) * own.points[pair.own];
  const double before = TriangleMesh::height(face, was), after = TriangleMesh::height(face, p);
  if (pair.pressed || before * after >= 0.0) return true;
  const Vec3 there = was + before / (before - after) * (p - was);
  return touch_face(there, 0.0, face.normal, 0.0, mesh.mesh().structure().vertices, mesh.mesh().triangle(pair.other),
                    1.0)
      .has_value();
}

}  // namespace proxarm::models
