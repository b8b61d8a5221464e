// Of what the tool is behind, what holds it nevertheless: the one that it is least deep under.
#include <algorithm>
#include <limits>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// A sine. Steps that are long beside a tool turn it by tenths of a radian on their way to where it ends.
constexpr double kLeans = 0.2;
// What a body may reach beyond the plane of a contact: normals of edges that cross at 1e-7 rad are rounded by 1e-9 rad,
// and bodies are up to a metre long. A lawful contact's plane leaves less, a false one's millimetres.
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

}  // namespace

// Two sharp edges that cross far behind each other hold nothing where another feature of the two solids keeps them
// apart, as where a corner lies on a side of a box, below its top: along that feature's normal all of one solid is
// before all of the other, or next to it. Crossing edges at a depth g leave no more than g cos φ along a normal at an
// angle φ to their own, so that half of g comes from another side only.
bool RigidWorld::beside(const Found& deep, const View& at) const noexcept {
  const Pair& pair = pairs_[deep.pair];
  const Solid* other = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  const Solid& own = shared_->parts[pair.part].solid;
  if (other == nullptr || shared_->parts[pair.part].mesh || own.radius + other->radius > 0.0) return false;
  const Placement* on = moves(pair.entry) ? &moving(pair.entry).mover.at() : nullptr;
  const double half = 0.5 * deep.touch.gap;
  for (std::size_t j = 0; j < found_count_; ++j) {
    const Pair& by = pairs_[found_[j].pair];
    const Vec3& n = found_[j].touch.normal;
    if (by.entry != pair.entry || by.part != pair.part || found_[j].touch.gap < half) continue;
    if (n.dot(deep.touch.normal) > 0.5) continue;
    const Vec3 n_T = at.R.transpose() * n, n_O = on == nullptr ? n : Vec3(on->R.transpose() * n);
    const double low = -extent_along(own, -n_T),
                 high = extent_along(*other, n_O) + (on != nullptr ? n.dot(on->x) : 0.0);
    if (low + n.dot(at.x) - high > half) return true;
  }
  return false;
}

// An edge of a convex solid and one of a mesh that cross behind each other hold nothing where the solid is beside the
// mesh's edge. Where that is sharper than 90°, the place behind it may lie before one of its faces, and an edge that
// ends there, with its corner on that face, isn't in the mesh; nor is the mesh's edge in the solid. One of both would
// not be enough: an edge that ends before it comes to the mesh may go on as the next one at a corner that is nearly
// flat, and what holds them out is this pair alone.
bool RigidWorld::passes_by(const Found& deep, const View& at) const noexcept {
  const Pair& pair = pairs_[deep.pair];
  if (pair.kind != Kind::edges) return false;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* solid = std::get_if<Solid>(&object.shape);
  const Part& part = shared_->parts[pair.part];
  const View& seen = moves(pair.entry) ? moving(pair.entry).tool : at;
  const auto passes = [](const Solid& convex, std::uint32_t index, const EdgeLine& of_mesh) {
    if (convex.radius > 0.0 || of_mesh.open) return false;
    return !enters(edge_of(convex, index), of_mesh) && !pierces(of_mesh, convex);
  };
  if (mesh != nullptr && !part.mesh) {
    const TriangleFeatures::Edge& edge = (*mesh)->edge(pair.other);
    return passes(part.solid, pair.own, edge_in_T(edge.line, seen, edge.ridge ? 1.0 : -1.0));
  }
  if (solid == nullptr || !part.mesh) return false;
  return passes(*solid, pair.other, moved_edge(edge_of(part.solid, pair.own), seen));
}

// Whether a solid would stand in a face on which a corner of it lies: parts of it are behind that face by far, seen
// from the corner. Such a face holds the corner of no lawful pose near this one.
bool RigidWorld::leans_into(const Found& corner, const View& at) const noexcept {
  const Pair& pair = pairs_[corner.pair];
  const auto* other = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  if (other == nullptr) return false;
  const bool own_corner = pair.kind == Kind::point_face;
  if (own_corner && shared_->parts[pair.part].mesh) return false;  // it isn't convex
  const Placement* on = moves(pair.entry) ? &moving(pair.entry).mover.at() : nullptr;
  // Out of the face, in the frame of the solid whose corner it is.
  const Vec3 n_O = on == nullptr ? corner.touch.normal : Vec3(on->R.transpose() * corner.touch.normal);
  const Vec3 n = own_corner ? Vec3(at.R.transpose() * corner.touch.normal) : Vec3(-n_O);
  const Solid& solid = own_corner ? shared_->parts[pair.part].solid : *other;
  const Vec3& tip = solid.points[own_corner ? pair.own : pair.other];
  for (const Vec3& p : solid.points) {
    const Vec3 d = p - tip;
    if (n.dot(d) < -kLeans * d.norm()) return true;
  }
  return false;
}

// Whether one of the two convex bodies that touch here reaches beyond the plane between them: then the normal is
// outside of the cone of normals that this body has there. A corner on a face's border, or on the rim of a cylinder's
// side, has its foot on that face, and none of its edges need be in the other body.
bool RigidWorld::reaches_beyond(const Found& found, const View& at) const noexcept {
  const Pair& pair = pairs_[found.pair];
  if (pair.kind == Kind::point_field || pair.kind == Kind::rim_field) return false;
  const Part& part = shared_->parts[pair.part];
  const Vec3 &n = found.touch.normal, &x = found.touch.point;
  if (!part.mesh) {
    const Vec3 down = -(at.R.transpose() * n);
    if (extent_along(part.solid, down) > down.dot(at.to_T(x)) + kBeyond_m) return true;
  }
  const auto* solid = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  if (solid == nullptr) return false;
  const Placement* on = moves(pair.entry) ? &moving(pair.entry).mover.at() : nullptr;
  const Vec3 foot = x - found.touch.gap * n, up = on == nullptr ? n : Vec3(on->R.transpose() * n);
  return extent_along(*solid, up) > up.dot(on == nullptr ? foot : on->back(foot)) + kBeyond_m;
}

// Of what presses. Whether there was any.
bool RigidWorld::bar_what_reaches_beyond(const ToolPose& pose) noexcept {
  const View at = view(pose);
  bool some = false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    const Found& found = found_[of_linear_[k]];
    if (linear_[k].state == ContactState::open || !reaches_beyond(found, at)) continue;
    pairs_[found.pair].barred = some = true;
  }
  return some;
}

// Whether one face of a closed mesh is all before another one's plane, as beside a valley: so is the foot on it then,
// though on the valley's line rounding may say otherwise. Both hold the point.
bool RigidWorld::rises_from(const Pair& one, const Pair& other) const noexcept {
  const Entry& entry = shared_->entries[one.entry];
  const bool of_tool = one.kind == Kind::face_point;
  if (!of_tool && entry.held == 0.0) return false;
  const TriangleFeatures& mesh = of_tool ? *shared_->parts[one.part].mesh
                                         : **std::get_if<std::shared_ptr<const TriangleFeatures>>(&entry.object.shape);
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

// A point inside of a convex solid, or under a ridge of a mesh, is behind several faces: only the one that it is least
// deep under holds it. The same for an object's point in a part of the tool.
void RigidWorld::drop_deeper(const View& at) noexcept {
  const auto same_point = [&](const Pair& a, const Pair& b) {
    if (a.kind != b.kind || a.part != b.part || a.entry != b.entry) return false;
    return a.kind == Kind::point_face ? a.own == b.own : a.kind == Kind::face_point && a.other == b.other;
  };
  // The foot of the deeper one on its face, seen from the other face.
  const auto behind = [&](const Found& deep, const Found& other, bool of_tool) {
    if (of_tool) return other.touch.normal.dot(other.touch.point - deep.touch.point) < kGap_m;
    const Vec3 foot = deep.touch.point - deep.touch.gap * deep.touch.normal;
    return other.touch.normal.dot(foot - (other.touch.point - other.touch.gap * other.touch.normal)) < kGap_m;
  };
  // A corner that a step takes over an edge is behind the faces on both sides of it, and may be less deep under the one
  // that it can't lie on.
  for (std::size_t i = 0; i < found_count_; ++i) {
    const Kind kind = pairs_[found_[i].pair].kind;
    if (!(found_[i].touch.gap < -kGap_m) || (kind != Kind::point_face && kind != Kind::face_point)) continue;
    for (std::size_t j = 0; j < found_count_; ++j) {
      if (j == i || found_[j].touch.gap < found_[i].touch.gap) continue;
      if (!same_point(pairs_[found_[i].pair], pairs_[found_[j].pair])) continue;
      if (!leans_into(found_[j], at) || leans_into(found_[i], at)) continue;
      found_[j] = found_[--found_count_];
      if (i == found_count_) i = j;
      --j;
    }
  }
  for (std::size_t i = 0; i < found_count_; ++i) {
    if (!(found_[i].touch.gap < -kGap_m) || found_[i].over) continue;
    const Pair& pair = pairs_[found_[i].pair];
    const bool is_sharp = pair.kind == Kind::edges || pair.kind == Kind::rim_edge || pair.kind == Kind::rims;
    if (is_sharp && (beside(found_[i], at) || passes_by(found_[i], at))) {
      found_[i--] = found_[--found_count_];
      continue;
    }
    if (pair.kind != Kind::point_face && pair.kind != Kind::face_point) continue;
    const bool is_mesh =
        std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(shared_->entries[pair.entry].object.shape);
    for (std::size_t j = 0; j < found_count_; ++j) {
      if (j == i || found_[j].touch.gap < found_[i].touch.gap || !same_point(pair, pairs_[found_[j].pair])) continue;
      // An open mesh's face may hold the point from behind: only one that it has come through counts here.
      if (is_mesh && pair.kind == Kind::point_face) {
        if (shared_->entries[pair.entry].held == 0.0 && !(found_[j].touch.gap < 0.0)) continue;
        if (!behind(found_[i], found_[j], false) || rises_from(pair, pairs_[found_[j].pair])) continue;
      }
      if (pair.kind == Kind::face_point && shared_->parts[pair.part].mesh) {
        if (!behind(found_[i], found_[j], true) || rises_from(pair, pairs_[found_[j].pair])) continue;
      }
      found_[i] = found_[--found_count_];
      --i;
      break;
    }
  }
}

}  // namespace proxarm::models
