// Of the features that the tool is behind: which of them hold it.
#include <algorithm>
#include <limits>
#include <utility>

#include "models/rigid_gaps/deeper_touches.hpp"

namespace proxarm::models {
namespace {

// A sine. Steps that are long beside a tool turn it by tenths of a radian on their way.
constexpr double kLeans = 0.2;
// How far a body may reach beyond the plane of a contact: normals of edges that cross at 1e-7 rad are rounded by
// 1e-9 rad, and bodies are up to a metre long. Beyond a lawful plane they reach less, beyond a false one millimetres.
constexpr double kBeyond_m = 1e-6;

// Whether a part of an edge is behind both of the faces beside another one, as far as these go on.
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

// Whether the line along an edge goes through a convex solid. (A ridge may be several edges of a mesh.)
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

// Whether both touches are of one point, of the tool or of the object.
bool same_point(const Pair& a, const Pair& b) noexcept {
  if (a.kind != b.kind || a.part != b.part || a.entry != b.entry) return false;
  return a.kind == PairKind::point_face ? a.own == b.own : a.kind == PairKind::face_point && a.other == b.other;
}

// Whether the foot of the deeper touch on its face is behind the other face.
bool is_behind(const Found& deep, const Found& other, bool of_tool) noexcept {
  if (of_tool) return other.touch.normal.dot(other.touch.point - deep.touch.point) < kGap_m;
  const Vec3 foot = deep.touch.point - deep.touch.gap * deep.touch.normal;
  return other.touch.normal.dot(foot - (other.touch.point - other.touch.gap * other.touch.normal)) < kGap_m;
}

// Two sharp edges that cross far behind each other hold nothing where another feature of the two solids keeps them
// apart, as where a corner lies on a side of a box, below its top: along that feature's normal all of one solid is
// before all of the other, or next to it. Crossing edges at a depth g leave no more than g cos φ along a normal at an
// angle φ to their own, so that half of g comes from another side only.
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

// An edge of a convex solid and one of a mesh that cross behind each other hold nothing where the solid is beside the
// mesh's edge. Where that is sharper than 90°, the place behind it may lie before one of its faces, and an edge that
// ends there, with its corner on that face, isn't in the mesh; nor is the mesh's edge in the solid. One of both would
// not be enough: an edge that ends before it comes to the mesh may go on as the next one at a corner that is nearly
// flat, and what holds them out is this pair alone.
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

// Whether a solid would stand in a face on which a corner of it lies: parts of it are behind that face by far, seen
// from the corner. Such a face holds the corner of no lawful pose near this one.
bool DeeperTouches::leans_into(const Found& corner) const noexcept {
  const Pair& pair = candidates_.pairs[corner.pair];
  const Solid* other = bodies_.entry(pair).solid();
  if (other == nullptr) return false;
  const bool own_corner = pair.kind == PairKind::point_face;
  if (own_corner && bodies_.part(pair).mesh) return false;  // it isn't convex
  // Out of the face, in the frame of the solid whose corner it is.
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

// Whether one face of a closed mesh is all before another one's plane, as beside a valley: so is the foot on it then,
// though on the valley's line rounding may say otherwise. Both hold the point.
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

// A corner that a step takes over an edge is behind the faces on both sides of it, and may be less deep under the one
// that it can't lie on.
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

// Whether another touch of the same point, less deep, holds it instead.
bool DeeperTouches::is_held_instead(const Found& deep, const Found& other) const noexcept {
  const Pair& pair = pair_of(deep);
  if (other.touch.gap < deep.touch.gap || !same_point(pair, pair_of(other))) return false;
  if (pair.kind == PairKind::point_face && bodies_.entry(pair).mesh() != nullptr) {
    // A face of an open mesh may hold the point from behind: only one that the point went through counts here.
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
