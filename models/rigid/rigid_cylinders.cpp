// A cylinder with flat ends beside another body: which of their features may meet, and how near they are. All is seen
// from the other body, whether the cylinder is the tool's part or the object.
#include <algorithm>
#include <cmath>

#include "models/rigid/beside_cylinder.hpp"
#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// The pairs of a cylinder's features and those of the other body. `add` takes the kind, the cylinder's feature and the
// other one's.
template <typename Kind, typename Add>
class CylinderPairs {
 public:
  CylinderPairs(Kind /*named*/, const Cylinder& cylinder, const BesideCylinder& body, double reach, Add add) noexcept
      : cylinder_(&cylinder), body_(&body), near_(reach + body.radius()), add_(add) {}

  void point(std::uint32_t i) const noexcept {
    const Vec3 p = body_->point(i), way = p - cylinder_->from;
    const double along = cylinder_->axis.dot(way);
    const double beside = (way - along * cylinder_->axis).norm() - cylinder_->radius;
    if (std::max({beside, -along, along - cylinder_->length}) > near_) return;
    if (beside >= -near_) add_(Kind::side_point, 0U, i);
    for (const std::uint32_t end : {0U, 1U}) {
      if (cylinder_->before_end(end, p) < -near_) continue;
      add_(Kind::end_point, end, i);
      if (body_->radius() > 0.0) add_(Kind::rim_point, end, i);
    }
  }
  void edge(std::uint32_t i) const noexcept {
    const EdgeLine edge = body_->edge(i);
    const double most = near_ + cylinder_->radius;
    if (distance2_of_segments(edge, axis_of(*cylinder_)) > most * most) return;
    add_(Kind::side_edge, 0U, i);
    const Vec3 middle = 0.5 * (edge.from + edge.to);
    const double half = 0.5 * (edge.to - edge.from).norm();
    for (const std::uint32_t end : {0U, 1U}) {
      if (comes_near_rim(end, middle, half)) add_(Kind::rim_edge, end, i);
    }
  }
  void face(std::uint32_t i) const noexcept {
    const BesideCylinder::Face face = body_->face(i);
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t corner : face.ring) middle += face.points[corner] / static_cast<double>(face.ring.size());
    double half2 = 0.0;
    for (const std::uint32_t corner : face.ring) half2 = std::max(half2, (face.points[corner] - middle).squaredNorm());
    for (const std::uint32_t end : {0U, 1U}) {
      const Solid::Rim& rim = cylinder_->rims[end];
      if (std::abs(BesideCylinder::height_of_lowest(rim, face.normal, face.offset)) > near_) continue;
      if (comes_near_rim(end, middle, std::sqrt(half2))) add_(Kind::rim_face, end, i);
    }
  }

 private:
  // Whether a ball does.
  [[nodiscard]] bool comes_near_rim(std::uint32_t end, const Vec3& middle, double radius) const noexcept {
    const double height = cylinder_->before_end(end, middle), most = near_ + radius;
    const Vec3 across = middle - cylinder_->rims[end].centre - height * cylinder_->out_of_end(end);
    const double beside = across.norm() - cylinder_->radius;
    return height * height + beside * beside <= most * most;
  }

  const Cylinder* cylinder_;
  const BesideCylinder* body_;
  double near_;
  Add add_;
};

}  // namespace

void RigidWorld::gather_cylinder(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const Part& own = shared_->parts[part];
  const Entry& other = shared_->entries[entry];
  if (own.cylinder && other.cylinder) return gather_cylinders(part, entry, at, reach);
  const bool ours = own.cylinder.has_value();
  const View to = ours ? at : inverse(at);
  const BesideCylinder body = beside_cylinder(part, entry);
  const Cylinder cylinder = moved(ours ? *own.cylinder : *other.cylinder, to.R, to.x);
  const CylinderPairs pairs(Kind::side_point, cylinder, body, reach,
                            [&](Kind kind, std::uint32_t round, std::uint32_t feature) {
                              add_pair(kind, part, entry, ours ? round : feature, ours ? feature : round, 0.0);
                            });
  if (const TriangleFeatures* mesh = body.mesh()) {
    const Solid& solid = ours ? own.solid : *std::get_if<Solid>(&other.object.shape);
    std::size_t looked_at = 0;
    const PartBox around(solid, ours ? own.box : other.box, to, reach);
    around.each_face(mesh->mesh(), [&](std::uint32_t face, const Bounds& /*box*/) {
      crowded_ = crowded_ || looked_at++ == face_room_;
      if (crowded_) return false;
      pairs.face(face);
      for (const std::uint32_t v : mesh->vertices_of(face)) pairs.point(v);
      for (const std::uint32_t e : mesh->edges_of(face)) {
        if (body.sticks_out(e)) pairs.edge(e);
      }
      return true;
    });
    near_faces_ += looked_at;
    return;
  }
  const Solid& solid = *body.solid();
  for (std::uint32_t i = 0; i < solid.points.size(); ++i) pairs.point(i);
  for (std::uint32_t i = 0; i < solid.edges.size(); ++i) pairs.edge(i);
  for (std::uint32_t i = 0; i < solid.faces.size(); ++i) pairs.face(i);
}

// What is beside the cylinder of the two.
BesideCylinder RigidWorld::beside_cylinder(std::uint16_t part, std::uint16_t entry) const noexcept {
  const Part& own = shared_->parts[part];
  const Entry& other = shared_->entries[entry];
  if (!own.cylinder) return own.mesh ? BesideCylinder(*own.mesh, 1.0) : BesideCylinder(own.solid);
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&other.object.shape);
  return mesh != nullptr ? BesideCylinder(**mesh, other.held)
                         : BesideCylinder(*std::get_if<Solid>(&other.object.shape));
}

// A cylinder and what is beside it, at a pose of the tool, seen from the latter.
struct RigidWorld::AtCylinder {
  AtCylinder(const RigidWorld& world, const Pair& pair, const View& tool) noexcept
      : AtCylinder(world, pair, tool, world.seen_from_other(pair, tool)) {}
  AtCylinder(const RigidWorld& world, const Pair& pair, const View& tool, const Cylinder& seen) noexcept
      : ours(world.shared_->parts[pair.part].cylinder.has_value()),
        round(ours ? pair.own : pair.other),
        feature(ours ? pair.other : pair.own),
        body(world.beside_cylinder(pair.part, pair.entry)),
        at(tool),
        cylinder(seen) {}

  // Seen from the object.
  [[nodiscard]] Touch touch(const Meeting& meeting) const noexcept {
    if (ours) return {meeting.on_cylinder, -meeting.out, meeting.gap};
    return {at * meeting.on_other, at.R * meeting.out, meeting.gap};
  }
  // The place of the cylinder's material where another pose has it.
  [[nodiscard]] Vec3 elsewhere(const Vec3& place, const View& other) const noexcept {
    return ours ? other * at.to_T(place) : other.to_T(at * place);
  }

  bool ours;  // the cylinder is the tool's
  std::uint32_t round, feature;
  BesideCylinder body;
  View at;
  Cylinder cylinder;
};

// Places where the two may meet. Their number; that of a place is what Found calls `which`.
int RigidWorld::meet(const Pair& pair, const AtCylinder& here, std::array<Meeting, 4>& out) const noexcept {
  const auto one = [&](const std::optional<Meeting>& meeting) {
    if (meeting) out[0] = *meeting;
    return meeting ? 1 : 0;
  };
  const BesideCylinder& body = here.body;
  switch (pair.kind) {
    case Kind::side_point:
      return one(meet_side(here.cylinder, body.point(here.feature), body.radius(), beside_));
    case Kind::end_point:
      return one(meet_end(here.cylinder, here.round, body.point(here.feature), body.radius(), beside_));
    case Kind::rim_point:
      return one(meet_rim(here.cylinder, here.round, body.point(here.feature), body.radius()));
    case Kind::side_edge:
      return one(meet_side(here.cylinder, body.edge(here.feature), body.radius(), beside_));
    case Kind::rim_edge: {
      std::array<Meeting, 2> places;
      const int count = meet_rim(here.cylinder, here.round, body.edge(here.feature), body.radius(), beside_, places);
      std::copy_n(places.begin(), count, out.begin());
      return count;
    }
    default:
      return meet_face(pair, here, out);
  }
}

int RigidWorld::meet_face(const Pair& pair, const AtCylinder& here, std::array<Meeting, 4>& out) const noexcept {
  const BesideCylinder::Face face = here.body.face(here.feature);
  const FlatSide side{face.normal, face.offset};
  std::array<Vec3, 4> places;
  const int count = nearest_of_rim(side, here.cylinder.rims[here.round], {pair.level[0], pair.level[1]}, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const double height = face.normal.dot(places[k]) - face.offset;
    out[k] = {places[k], places[k] - height * face.normal, -face.normal, height};
  }
  return count;
}

// Whether a meeting counts: its foot is on the face, and what meets there isn't less deep under another surface, which
// holds it then. A corner that lies on an end is behind the side as well.
bool RigidWorld::counts(const Pair& pair, const AtCylinder& here, const Meeting& meeting) const noexcept {
  if (pair.kind == Kind::rim_face && !here.body.face(here.feature).over(meeting.on_cylinder, beside_)) return false;
  if (!(meeting.gap < -kGap_m)) return true;
  if (here.body.radius() > 0.0) return true;  // of a centre outside of the cylinder one feature is nearest
  const Cylinder& cylinder = here.cylinder;
  const auto before = [&](std::uint32_t end) { return cylinder.before_end(end, meeting.on_other); };
  switch (pair.kind) {
    case Kind::side_point:
    case Kind::side_edge:
      return std::max(before(0), before(1)) <= meeting.gap;
    case Kind::end_point: {
      const double across = cylinder.axis.cross(meeting.on_other - cylinder.from).norm();
      return std::max(before(1 - here.round), across - cylinder.radius) <= meeting.gap;
    }
    case Kind::rim_face:
      if (here.body.mesh() != nullptr) return !was_behind(pair, here, meeting.on_cylinder);
      if (came_around(pair, here, meeting.on_cylinder)) return false;
      return here.body.highest_over_others(cylinder.rims[here.round], here.feature) <= meeting.gap;
    case Kind::rim_edge:
      return !was_behind_edge(pair, here, meeting.on_cylinder);
    default:
      return true;
  }
}

// Whether a place of a rim was behind a mesh's face at the beginning without having come through it: further than it
// may come back from, or over the face.
bool RigidWorld::was_behind(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const Vec3 was = here.elsewhere(place, from_of(pair));
  const BesideCylinder::Face face = here.body.face(here.feature);
  const double height = face.normal.dot(was) - face.offset;
  if (height >= -kFront_m) return false;
  return height < -behind_m_ || face.over(was);
}

// Whether a place of a rim that was behind a solid's face at the beginning is outside of the solid, before another one
// of its faces: it came around an edge.
bool RigidWorld::came_around(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const BesideCylinder::Face face = here.body.face(here.feature);
  return face.normal.dot(here.elsewhere(place, from_of(pair))) - face.offset < -kFront_m &&
         is_outside(*here.body.solid(), place);
}

// An edge far behind the rim, as one on the body's other side.
bool RigidWorld::was_behind_edge(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const Solid::Rim& rim = here.cylinder.rims[here.round];
  const Vec2 in_rim((place - rim.centre).dot(rim.u), (place - rim.centre).dot(rim.v));
  const AtCylinder was(*this, pair, from_of(pair));
  return height_of_rim(was.cylinder, here.round, here.body.edge(here.feature), in_rim) < -behind_m_;
}

View RigidWorld::from_of(const Pair& pair) const noexcept {
  return moves(pair.entry) ? moving(pair.entry).from : view(from_);
}

// The cylinder of the two, seen from what is beside it.
Cylinder RigidWorld::seen_from_other(const Pair& pair, const View& at) const noexcept {
  const std::optional<Cylinder>& own = shared_->parts[pair.part].cylinder;
  if (own) return moved(*own, at.R, at.x);
  const View to = inverse(at);
  return moved(*shared_->entries[pair.entry].cylinder, to.R, to.x);
}

// Of a part and an entry many pairs follow each other.
const Cylinder& RigidWorld::cylinder_found(const Pair& pair, const View& at) noexcept {
  if (!at_pose_.known || at_pose_.part != pair.part || at_pose_.entry != pair.entry) {
    at_pose_ = {true, pair.part, pair.entry, seen_from_other(pair, at)};
  }
  return at_pose_.cylinder;
}

int RigidWorld::touch_cylinder(const Pair& pair, const View& at, std::array<Touch, 4>& out) noexcept {
  if (pair.kind >= Kind::sides) return touch_cylinders(pair, at, out);
  const AtCylinder here(*this, pair, at, cylinder_found(pair, at));
  std::array<Meeting, 4> places;
  const int count = meet(pair, here, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    out[k] = here.touch(places[k]);
    if (!counts(pair, here, places[k])) out[k].gap = std::numeric_limits<double>::infinity();
  }
  return count;
}

FlatSide RigidWorld::side_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept {
  if (pair.kind != Kind::rim_face) return end_under_rim(pair, at, rim);
  const AtCylinder here(*this, pair, at);
  const BesideCylinder::Face face = here.body.face(here.feature);
  rim = here.cylinder.rims[here.round];
  return {face.normal, face.offset};
}

}  // namespace proxarm::models
