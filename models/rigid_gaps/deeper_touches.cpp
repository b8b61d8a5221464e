// Decides which of the features that the tool is behind hold the tool.
#include <algorithm>
#include <limits>
#include <utility>

#include "models/rigid_gaps/deeper_touches.hpp"

namespace proxarm::models {
namespace {

// A sine: the angle by which a solid may lean into a face. A step that is long compared with the tool turns the tool by
// some tenths of a radian.
constexpr double kLeans = 0.2;
// How far a body may reach beyond the plane of a contact. Normals of edges that cross at 1e-7 rad are rounded by 1e-9
// rad, and bodies are up to a metre long, so beyond a correct plane bodies reach less than this. Beyond a false plane
// they reach millimetres.
constexpr double kBeyond_m = 1e-6;

// Whether a part of an edge is behind both faces beside the edge `wedge`; these faces are taken as endless planes.
bool enters(const EdgeLine& edge, const EdgeLine& wedge) noexcept {
  double low = 0.0, high = 1.0;
  for (const Vec3& n : {wedge.left, wedge.right}) {
    const double from = n.dot(edge.from - wedge.from) + kGap_m, to = n.dot(edge.to - wedge.from) + kGap_m;
    if (from > 0.0 && to > 0.0) return false;
    if (from > 0.0) low = std::max(low, from / (from - to));
    if (to > 0.0) high = std::min(high, from / (from - to));
  }
  return low <= high;
}

// Whether the endless line along an edge goes through a convex solid. The line is endless because a ridge may consist
// of several edges of a mesh.
bool pierces(const EdgeLine& edge, const Solid& solid) noexcept {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const Solid::Face& face : solid.faces) {
    const double height = face.normal.dot(edge.from) - face.offset - kGap_m,
                 rise = face.normal.dot(edge.to - edge.from);
    if (rise == 0.0 && height > 0.0) return false;
    if (rise > 0.0) high = std::min(high, -height / rise);
    if (rise < 0.0) low = std::max(low, -height / rise);
  }
  return low <= high;
}

class DeeperTouches {
 public:
  DeeperTouches(const RigidBodies& bodies, const Candidates& candidates, const View& at, Touches& touches) noexcept
      : bodies_(bodies), candidates_(candidates), at_(at), touches_(touches) {}

  void drop() noexcept {
    drop_leaning_corners();
    for (std::size_t i = 0; i < touches_.count;) {
      if (holds_nothing(touches_.found[i])) {
        touches_.found[i] = touches_.found[--touches_.count];
      } else {
        ++i;
      }
    }
  }

 private:
  [[nodiscard]] const Pair& pair_of(const Found& found) const noexcept { return candidates_.pairs[found.pair]; }
  void drop_leaning_corners() noexcept;
  [[nodiscard]] bool holds_nothing(const Found& deep) const noexcept;
  [[nodiscard]] bool is_held_instead(const Found& deep, const Found& other) const noexcept;
  [[nodiscard]] bool is_beside(const Found& deep) const noexcept;
  [[nodiscard]] bool passes_by(const Found& deep) const noexcept;
  [[nodiscard]] bool leans_into(const Found& corner) const noexcept;
  [[nodiscard]] bool rises_from(const Pair& one, const Pair& other) const noexcept;

  const RigidBodies& bodies_;
  const Candidates& candidates_;
  const View& at_;
  Touches& touches_;
};

// Whether both pairs have the same point of the tool, or the same point of the object.
bool same_point(const Pair& a, const Pair& b) noexcept {
  if (a.kind != b.kind || a.part != b.part || a.entry != b.entry) return false;
  return a.kind == PairKind::point_face ? a.own == b.own : a.kind == PairKind::face_point && a.other == b.other;
}

// Whether the foot of the touch `deep` on its face is behind the face of the touch `other`.
bool is_behind(const Found& deep, const Found& other, bool of_tool) noexcept {
  if (of_tool) return other.touch.normal.dot(other.touch.point - deep.touch.point) < kGap_m;
  const Vec3 foot = deep.touch.point - deep.touch.gap * deep.touch.normal;
  return other.touch.normal.dot(foot - (other.touch.point - other.touch.gap * other.touch.normal)) < kGap_m;
}

// Whether two sharp edges that cross far behind each other hold nothing, because another pair of features of the two
// solids keeps the solids apart. (Example: a corner lies on a side of a box, below the box's top.)
// 1. The solids are kept apart if, along the other pair's normal, the gap between the whole solids is more than half of
//    the edges' negative gap g.
// 2. Crossing edges with the gap g leave at most g cos φ along a normal at an angle φ to their own normal. So only
//    normals with cos φ of at most 0.5 are tried.
bool DeeperTouches::is_beside(const Found& deep) const noexcept {
  const Pair& pair = candidates_.pairs[deep.pair];
  const Solid* other = bodies_.entry(pair).solid();
  const Solid& own = bodies_.part(pair).solid;
  if (other == nullptr || bodies_.part(pair).mesh || own.radius + other->radius > 0.0) return false;
  const Placement* on = bodies_.placement(pair.entry);
  const double half = 0.5 * deep.touch.gap;
  for (std::size_t j = 0; j < touches_.count; ++j) {
    const Pair& by = candidates_.pairs[touches_.found[j].pair];
    const Vec3& n = touches_.found[j].touch.normal;
    if (by.entry != pair.entry || by.part != pair.part || touches_.found[j].touch.gap < half) continue;
    if (n.dot(deep.touch.normal) > 0.5) continue;
    const Vec3 n_T = at_.R.transpose() * n, n_O = bodies_.direction_in_object(pair.entry, n);
    const double low = -extent_along(own, -n_T),
                 high = extent_along(*other, n_O) + (on != nullptr ? n.dot(on->x) : 0.0);
    if (low + n.dot(at_.x) - high > half) return true;
  }
  return false;
}

// Whether an edge of a convex solid and an edge of a mesh that cross behind each other hold nothing, because the solid
// is beside the mesh's edge. (If the mesh's edge is sharper than 90°, a place behind the edge may lie in front of one
// of the edge's faces. A solid's edge that ends there, with its corner on that face, isn't inside the mesh.) Two
// conditions must both be true:
// 1. No part of the solid's edge is behind both faces of the mesh's edge.
// 2. The mesh's edge doesn't go through the solid. Condition 1 alone isn't enough: the solid's edge may end before it
//    reaches the mesh and continue, at a nearly flat corner, as the next edge. This pair alone may then keep solid and
//    mesh apart.
bool DeeperTouches::passes_by(const Found& deep) const noexcept {
  const Pair& pair = candidates_.pairs[deep.pair];
  if (pair.kind != PairKind::edges) return false;
  const TriangleFeatures* mesh = bodies_.entry(pair).mesh();
  const Solid* solid = bodies_.entry(pair).solid();
  const RigidPart& part = bodies_.part(pair);
  const View& seen = bodies_.moves(pair.entry) ? bodies_.moving(pair.entry).tool : at_;
  const auto passes = [](const Solid& convex, std::uint32_t index, const EdgeLine& of_mesh) {
    if (convex.radius > 0.0 || of_mesh.open) return false;
    return !enters(edge_of(convex, index), of_mesh) && !pierces(of_mesh, convex);
  };
  if (mesh != nullptr && !part.mesh) {
    const TriangleFeatures::Edge& edge = mesh->edge(pair.other);
    return passes(part.solid, pair.own, edge_in_T(edge.line, seen, edge.ridge ? 1.0 : -1.0));
  }
  if (solid == nullptr || !part.mesh) return false;
  return passes(*solid, pair.other, moved_edge(edge_of(part.solid, pair.own), seen));
}

// Whether a solid whose corner lies on a face leans far into the face: seen from the corner, other points of the solid
// are far behind the face. Such a face can't hold the corner at any correct pose near the present pose.
bool DeeperTouches::leans_into(const Found& corner) const noexcept {
  const Pair& pair = candidates_.pairs[corner.pair];
  const Solid* other = bodies_.entry(pair).solid();
  if (other == nullptr) return false;
  const bool own_corner = pair.kind == PairKind::point_face;
  if (own_corner && bodies_.part(pair).mesh) return false;  // a mesh isn't convex
  // The normal out of the face, in the frame of the solid that has the corner.
  const Vec3 n_O = bodies_.direction_in_object(pair.entry, corner.touch.normal);
  const Vec3 n = own_corner ? Vec3(at_.R.transpose() * corner.touch.normal) : Vec3(-n_O);
  const Solid& solid = own_corner ? bodies_.part(pair).solid : *other;
  const Vec3& tip = solid.points[own_corner ? pair.own : pair.other];
  for (const Vec3& p : solid.points) {
    const Vec3 d = p - tip;
    if (n.dot(d) < -kLeans * d.norm()) return true;
  }
  return false;
}

// Whether the face of the pair `one` lies completely in front of the plane of the other pair's face, as beside a valley
// of a closed mesh. A foot on the first face then is in front of that plane, too, even if on the valley's line rounding
// says otherwise. So both faces hold the point.
bool DeeperTouches::rises_from(const Pair& one, const Pair& other) const noexcept {
  const RigidEntry& entry = bodies_.entry(one);
  const bool of_tool = one.kind == PairKind::face_point;
  if (!of_tool && entry.held == 0.0) return false;
  const TriangleFeatures& mesh = of_tool ? *bodies_.part(one).mesh : *entry.mesh();
  const std::uint32_t face = of_tool ? one.own : one.other, base = of_tool ? other.own : other.other;
  const double side = of_tool ? 1.0 : static_cast<double>(one.side);
  double low = 0.0, high = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double height = side * TriangleMesh::height(face_of(mesh, base), mesh.mesh().corner(face, k));
    low = std::min(low, height);
    high = std::max(high, height);
  }
  return low > -kGap_m && high > kGap_m;
}

// Drops touches of corners with faces into which the corner's solid leans, if a deeper touch holds the corner. (If a
// step takes a corner over an edge, the corner is behind the faces on both sides of the edge. It may be less deep under
// the face on which it can't lie.)
void DeeperTouches::drop_leaning_corners() noexcept {
  auto& found = touches_.found;
  for (std::size_t i = 0; i < touches_.count; ++i) {
    const PairKind kind = pair_of(found[i]).kind;
    if (!(found[i].touch.gap < -kGap_m) || !is_point_and_face(kind)) continue;
    for (std::size_t j = 0; j < touches_.count; ++j) {
      if (j == i || found[j].touch.gap < found[i].touch.gap) continue;
      if (!same_point(pair_of(found[i]), pair_of(found[j]))) continue;
      if (!leans_into(found[j]) || leans_into(found[i])) continue;
      found[j] = found[--touches_.count];
      if (i == touches_.count) i = j;
      --j;
    }
  }
}

bool DeeperTouches::holds_nothing(const Found& deep) const noexcept {
  if (!(deep.touch.gap < -kGap_m) || deep.over) return false;
  const Pair& pair = pair_of(deep);
  const bool is_sharp = pair.kind == PairKind::edges || pair.kind == PairKind::rim_edge || pair.kind == PairKind::rims;
  if (is_sharp) return is_beside(deep) || passes_by(deep);
  if (!is_point_and_face(pair.kind)) return false;
  const auto holds_it = [&](const Found& other) { return &other != &deep && is_held_instead(deep, other); };
  const std::span<const Found> all = std::as_const(touches_).all();
  return std::any_of(all.begin(), all.end(), holds_it);
}

// Whether the touch `other` of the same point is less deep and holds the point instead of the touch `deep`.
bool DeeperTouches::is_held_instead(const Found& deep, const Found& other) const noexcept {
  const Pair& pair = pair_of(deep);
  if (other.touch.gap < deep.touch.gap || !same_point(pair, pair_of(other))) return false;
  if (pair.kind == PairKind::point_face && bodies_.entry(pair).mesh() != nullptr) {
    // A face of an open mesh may hold the point from its other side. So only a face that the point went through counts
    // here.
    if (bodies_.entry(pair).held == 0.0 && !(other.touch.gap < 0.0)) return false;
    return is_behind(deep, other, false) && !rises_from(pair, pair_of(other));
  }
  if (pair.kind == PairKind::face_point && bodies_.part(pair).mesh) {
    return is_behind(deep, other, true) && !rises_from(pair, pair_of(other));
  }
  return true;
}

}  // namespace

void drop_deeper(const RigidBodies& bodies, const Candidates& candidates, const View& at, Touches& touches) noexcept {
  DeeperTouches(bodies, candidates, at, touches).drop();
}

bool reaches_beyond(const RigidBodies& bodies, const Pair& pair, const Touch& touch, const View& at) noexcept {
  if (is_in_field(pair.kind)) return false;
  const RigidPart& part = bodies.part(pair);
  const Vec3 &n = touch.normal, &x = touch.point;
  if (!part.mesh) {
    const Vec3 down = -(at.R.transpose() * n);
    if (extent_along(part.solid, down) > down.dot(at.to_T(x)) + kBeyond_m) return true;
  }
  const Solid* solid = bodies.entry(pair).solid();
  if (solid == nullptr) return false;
  const Placement* on = bodies.placement(pair.entry);
  const Vec3 foot = x - touch.gap * n, up = bodies.direction_in_object(pair.entry, n);
  return extent_along(*solid, up) > up.dot(on == nullptr ? foot : on->back(foot)) + kBeyond_m;
}

}  // namespace proxarm::models
