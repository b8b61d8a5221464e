// On which side of a feature the tool is, and how far from it.
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

// A sine. Steps that are long beside a tool turn it by tenths of a radian on their way to where it ends.
constexpr double kLeans = 0.2;

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
  const EdgeLine a = edge_of(own, pair.own);
  const EdgeLine b = mesh != nullptr ? (*mesh)->edge(pair.other).line : edge_of(*solid, pair.other);
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
    if (pair.kind != Kind::point_face && pair.kind != Kind::face_point && pair.kind != Kind::edges) continue;
    const View& at = i < still_count_ ? at_W : moving(pair.entry).from;
    const RigidObject& object = shared_->entries[pair.entry].object;
    const bool is_mesh = std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(object.shape);
    const double own_radius = shared_->parts[pair.part].solid.radius;
    if (pair.kind == Kind::edges) {
      const double radii = own_radius + (is_mesh ? 0.0 : std::get_if<Solid>(&object.shape)->radius);
      if (radii > 0.0) continue;
    }
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
  const auto other_edge = [&] {
    return mesh != nullptr ? (*mesh)->edge(pair.other).line : edge_of(*solid, pair.other);
  };
  const auto own_edge = [&] { return moved_edge(edge_of(own, pair.own), at); };
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
    case Kind::edges: {
      EdgeLine other = other_edge();
      const EdgeLine edge = own_edge();
      if (radii > 0.0) return emit(touch_edges_round(edge, other, radii, own.radius), lift);
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
      return emit(touch_round(at * own.points[pair.own], other_edge(), radii, own.radius, false), lift);
    case Kind::edge_point:
      return emit(touch_round(other_point(), own_edge(), radii, own.radius, true), lift);
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
  const auto height = [&y](const Solid::Face& face) { return face.normal.dot(y) - face.offset; };
  if (!(height(solid->faces[of_tool ? pair.own : pair.other]) < -kGap_m)) return false;
  return std::any_of(solid->faces.begin(), solid->faces.end(),
                     [&](const Solid::Face& face) { return height(face) > kGap_m; });
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
  // A foot may lie beside a feature by as much.
  const bool all = within_m == kEverywhere_m;
  const double near_m =
      all ? kEverywhere_m : motion(pose, gathered_at_) + within_m + std::max(beside_, over_m_) + kFront_m;
  for (std::size_t i = first_pair(); i < pair_count_; ++i) {
    const Moving* on = i < still_count_ ? nullptr : &moving(pairs_[i].entry);
    if (on != nullptr && !on->close) continue;
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
