// Which features the tool meets at a pose, and how far it is from them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// How far in front of a mesh's faces its surface is: a face has no inside from which a tool could be brought back, so
// rounding must not take a tool in contact through it. Coordinates below a metre are rounded by 1e-16 m, and what is
// left of the iteration is as small; this is a thousand times that, and a tenth of what a gap may be short of.
constexpr double kLift_m = 1e-13;

// What a pair of a cylinder's features costs more than others, in their 15 ns: 120 to 150 ns.
constexpr int kOfCylinder = 10, kOfTwoCylinders = 30, kRims = 600;

}  // namespace

Solid::Rim RigidWorld::rim_at(const Solid::Rim& rim, const View& at) noexcept {
  return {at * rim.centre, at.R * rim.u, at.R * rim.v, rim.radius};
}

// While a rim lies flat, where it was lowest before says where it would tip.
void RigidWorld::remember_lowest(Pair& pair, const View& at) const noexcept {
  Vec2 lowest = Vec2::Zero();
  if (pair.kind != Kind::rim_field) {
    Solid::Rim rim;
    const FlatSide side = side_under_rim(pair, at, rim);
    lowest = lowest_of_rim(side, rim);
  } else if (const auto* flat = std::get_if<FlatSide>(&shared_->entries[pair.entry].object.shape)) {
    lowest = lowest_of_rim(*flat, rim_at(shared_->parts[pair.part].solid.rims[pair.own], at));
  }
  if (!lowest.isZero(0.0)) pair.level = {lowest.x(), lowest.y()};
}

EdgeLine RigidWorld::own_edge(const Pair& pair) const noexcept {
  return edge_of(shared_->parts[pair.part].solid, pair.own);
}

EdgeLine RigidWorld::other_edge(const Pair& pair) const noexcept {
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  return mesh != nullptr ? (*mesh)->edge(pair.other).line : edge_of(*std::get_if<Solid>(&object.shape), pair.other);
}

template <typename Each>
void RigidWorld::evaluate(const Pair& pair, const View& at, Each each) noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto emit = [&](std::optional<Touch> t, double lift = 0.0) {
    if (!t) return;
    t->gap -= lift;
    each(*t, 0);
  };
  if (pair.kind == Kind::point_field || pair.kind == Kind::rim_field) {
    with_flat_or_hollow(object, [&](const auto& shape) {
      if (pair.kind == Kind::point_field) return each(touch(shape, at * own.points[pair.own], own.radius), 0);
      const Solid::Rim rim = rim_at(own.rims[pair.own], at);
      std::array<Vec3, 4> places;
      const int count = nearest_of_rim(shape, rim, {pair.level[0], pair.level[1]}, places);
      for (int k = 0; k < count; ++k) each(touch(shape, places[static_cast<std::size_t>(k)], 0.0), k);
    });
    return;
  }
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* solid = std::get_if<Solid>(&object.shape);
  const double lift = mesh != nullptr ? kLift_m : 0.0, other_radius = solid != nullptr ? solid->radius : 0.0;
  const double radii = own.radius + other_radius;
  const auto other_point = [&] { return mesh != nullptr ? (*mesh)->vertex(pair.other) : solid->points[pair.other]; };
  const double side = static_cast<double>(pair.side);
  switch (pair.kind) {
    case Kind::point_face: {
      if (side == 0.0) return;
      const Vec3 p = at * own.points[pair.own];
      if (mesh != nullptr) {
        const TriangleMesh::Face& face = face_of(**mesh, pair.other);
        const double height = side * TriangleMesh::height(face, p);
        if (shared_->entries[pair.entry].held == 0.0 && own.radius == 0.0 && height < 0.0) {
          // Come through the face, wherever it is now; or come around, and then another face holds it.
          if (crossed(pair, p)) emit(Touch{p, side * face.normal, height}, lift);
          return;
        }
        return emit(
            touch_face(p, own.radius, face.normal, face.normal.dot(face.corner), (*mesh)->mesh().structure().vertices,
                       (*mesh)->mesh().triangle(pair.other), side, beside_),
            lift);
      }
      const Solid::Face& face = solid->faces[pair.other];
      return emit(
          touch_face(p, own.radius, face.normal, face.offset, solid->points, solid->corners(face), 1.0, beside_));
    }
    case Kind::face_point: {
      if (side == 0.0) return;
      const Solid::Face& face = own.faces[pair.own];
      const Vec3 y = at.R.transpose() * (other_point() - at.x);
      std::optional<Touch> t =
          touch_face(y, other_radius, face.normal, face.offset, own.points, own.corners(face), 1.0, beside_);
      if (!t) return;
      const Vec3 foot = y - (t->gap + other_radius) * face.normal;
      return emit(Touch{at * foot, -(at.R * face.normal), t->gap}, lift);
    }
    case Kind::round_edges:
      return emit(touch_edges_round(moved_edge(own_edge(pair), at), other_edge(pair), radii, own.radius), lift);
    case Kind::edges: {
      EdgeLine other = other_edge(pair);
      const EdgeLine edge = moved_edge(own_edge(pair), at);
      if (side == 0.0) return;
      if (mesh != nullptr && !other.open && !(*mesh)->edge(pair.other).ridge) {
        other.left = -other.left;
        other.right = -other.right;
      }
      const Vec3 n = (edge.to - edge.from).cross(other.to - other.from);
      const double orientation = other.open ? side : n.dot(other.left + other.right) < 0.0 ? -1.0 : 1.0;
      return emit(touch_edges_sharp(edge, other, orientation, beside_), lift);
    }
    case Kind::point_point: {
      std::optional<Touch> t = touch_point(at * own.points[pair.own], other_point(), radii);
      if (t) t->point -= own.radius * t->normal;
      return emit(t, lift);
    }
    case Kind::point_edge:
      return emit(touch_round(at * own.points[pair.own], other_edge(pair), radii, own.radius, false), lift);
    case Kind::edge_point:
      return emit(touch_round(other_point(), moved_edge(own_edge(pair), at), radii, own.radius, true), lift);
    case Kind::point_field:
    case Kind::rim_field:
      return;
    default: {
      std::array<Touch, 4> touches;
      const int count = touch_cylinder(pair, at, touches);
      for (int k = 0; k < count; ++k) each(touches[static_cast<std::size_t>(k)], k);
    }
  }
}

// A face of a closed mesh goes on beyond its valleys, inside of the body: there a point that is before it is before the
// valley's other face as well, or in that. A corner in a valley that a pose of the iteration takes behind one face by
// some nanometres has its foot on the other one beyond the valley by as much; not to be found there, it let the tool go
// by tenths of a millimetre, to where something else held it. So what pressed in the last solution still counts as far
// beyond as the last step went. (Next to a valley's end the body may end there, too: what a step ends on has its foot
// on its face.)
std::optional<Touch> RigidWorld::over_valley(const Pair& pair, const View& at) const noexcept {
  const Entry& entry = shared_->entries[pair.entry];
  const Part& part = shared_->parts[pair.part];
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&entry.object.shape);
  const bool ours = pair.kind == Kind::face_point;
  const TriangleFeatures* features = ours ? part.mesh.get() : mesh != nullptr ? mesh->get() : nullptr;
  if (features == nullptr || pair.side == 0.0F) return {};
  if (!ours && (pair.kind != Kind::point_face || entry.held == 0.0)) return {};
  const std::uint32_t index = ours ? pair.own : pair.other;
  const double side = ours ? 1.0 : static_cast<double>(pair.side);
  const std::uint8_t valleys = features->valleys_of(index, side);
  if (valleys == 0) return {};
  const Solid* solid = std::get_if<Solid>(&entry.object.shape);
  const double radius = ours ? (solid != nullptr ? solid->radius : 0.0) : part.solid.radius;
  const Vec3 p = !ours ? at * part.solid.points[pair.own]
                       : at.to_T(mesh != nullptr ? (*mesh)->vertex(pair.other) : solid->points[pair.other]);
  const Vec3& n = face_of(*features, index).normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& corner = features->mesh().corner(index, k);
    const Vec3 inwards = n.cross(features->mesh().corner(index, (k + 1) % 3) - corner);
    const double off = (valleys >> k & 1U) != 0 ? over_m_ : beside_m;
    if (inwards.dot(p - corner) < -off * inwards.norm()) return {};
  }
  const double gap = side * TriangleMesh::height(face_of(*features, index), p) - radius,
               lift = mesh != nullptr ? kLift_m : 0.0;
  if (!ours) return Touch{p - radius * side * n, side * n, gap - lift};
  return Touch{at * Vec3(p - (gap + radius) * n), -(at.R * n), gap - lift};
}

// What pressed in the last solution, beyond its end by no more than the last step went. An edge of the tool that lies
// on a vertex crosses one edge there or another one, as a pose of the iteration has it by nanometres: the one that it
// left wasn't found, nothing held the tool there any more, and it went on by half a millimetre, to where something else
// did.
template <typename Each>
void RigidWorld::evaluate_over(const Pair& pair, const View& at, Each each) noexcept {
  if (const std::optional<Touch> t = over_valley(pair, at)) return each(*t, 0);
  if (pair.kind != Kind::edges) return;
  const double beside = std::exchange(beside_, std::max(beside_, over_m_));
  evaluate(pair, at, each);
  beside_ = beside;
}

// Whether a point that comes from behind a face of a convex solid is still before another one of its faces: then it is
// outside, and what is deep under the face isn't in the solid. Where the solid is thin, as next to a tip, the far side
// of an edge is near that a point lies under.
bool RigidWorld::is_beyond_edge(const Pair& pair, double gap, const View& at) const noexcept {
  const bool of_tool = pair.kind == Kind::face_point;
  if (!(gap < -kGap_m) || (!of_tool && pair.kind != Kind::point_face)) return false;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* other = std::get_if<Solid>(&object.shape);
  const Part& part = shared_->parts[pair.part];
  const Solid* solid = !of_tool ? other : part.mesh ? nullptr : &part.solid;
  if (solid == nullptr || !(signed_start(pair, from_of(pair)) < -kFront_m)) return false;
  const Vec3 y = !of_tool ? at * part.solid.points[pair.own]
                          : at.to_T(mesh != nullptr ? (*mesh)->vertex(pair.other) : other->points[pair.other]);
  const Solid::Face& face = solid->faces[of_tool ? pair.own : pair.other];
  return face.normal.dot(y) - face.offset < -kGap_m && is_outside(*solid, y);
}

void RigidWorld::find(const ToolPose& pose, double within_m) noexcept {
  looks_ -= static_cast<int>(pair_count_);
  look_at_pairs(pose, within_m);
  const auto needs = [&](const Found& found) { return needs_others(found); };
  const auto end = found_.begin() + static_cast<std::ptrdiff_t>(found_count_);
  if (within_m_ < kEverywhere_m && std::any_of(found_.begin(), end, needs)) look_at_pairs(pose, kEverywhere_m);
  drop_deeper(view(pose));
}

// Whether what is far away may tell that this one holds nothing: edges that cross behind each other, or what is behind
// by more than the others are before.
bool RigidWorld::needs_others(const Found& found) const noexcept {
  const Kind kind = pairs_[found.pair].kind;
  return found.touch.gap < (kind == Kind::edges ? -kGap_m : -within_m_);
}

void RigidWorld::look_at_pairs(const ToolPose& pose, double within_m) noexcept {
  found_count_ = 0;
  at_pose_.known = false;
  within_m_ = kEverywhere_m;
  const View at_W = view(pose);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    moving_[i].tool = seen_from(static_cast<std::uint16_t>(shared_->first_moving + i), at_W);
  }
  // What the tool is behind, having come through another feature, is no deeper than it has come since it was outside.
  // And a foot may lie beside a feature.
  const double near_m = within_m == kEverywhere_m ? kEverywhere_m
                                                  : motion(pose, gathered_at_) + motion(pose, from_) + within_m +
                                                        std::max(beside_, over_m_) + kFront_m;
  for (std::size_t i = first_pair(); i < pair_count_; ++i) {
    const Moving* on = i < still_count_ ? nullptr : &moving(pairs_[i].entry);
    if (pairs_[i].barred || (on != nullptr && !on->close)) continue;
    if (on == nullptr && pairs_[i].apart_m > near_m && !pairs_[i].pressed) {
      within_m_ = within_m;
      continue;
    }
    const View& at = on == nullptr ? at_W : on->tool;
    const Kind kind = pairs_[i].kind;
    if (kind >= Kind::sides) {
      looks_ -= kind == Kind::rims ? kRims : kOfTwoCylinders;
    } else if (kind >= Kind::side_point) {
      looks_ -= kOfCylinder;
    }
    if (is_flat_rim(kind)) remember_lowest(pairs_[i], at);
    const std::size_t before = found_count_;
    const auto add = [&](const Touch& t, int which) {
      if (t.gap > gathered_reach_) return;  // no step that stays among the pairs comes so far
      if (found_count_ == most_found) {
        overflow_ = true;
        return;
      }
      Found& found = found_[found_count_++];
      found.touch = t;
      if (on != nullptr) {
        found.touch.point = on->mover.at() * t.point;
        found.touch.normal = on->mover.at().R * t.normal;
      }
      found.pair = static_cast<std::uint16_t>(i);
      found.which = static_cast<std::uint8_t>(which);
      found.working = found.over = false;
      if (is_along_side(pairs_[i].kind)) stay_along_side(found, pose);
    };
    evaluate(pairs_[i], at, add);
    if (found_count_ > before && is_beyond_edge(pairs_[i], found_[before].touch.gap, at)) found_count_ = before;
    if (found_count_ > before || !pairs_[i].pressed || !(over_m_ > beside_m)) continue;
    evaluate_over(pairs_[i], at, add);
    if (found_count_ > before) found_[before].over = true;
  }
}

}  // namespace proxarm::models
