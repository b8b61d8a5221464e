#include "models/rigid_cylinder/cylinder_gaps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

int meet_face(const Pair& pair, const Solid::Rim& rim, const BesideCylinder::Face& face,
              std::array<Meeting, 4>& out) noexcept {
  const FlatSide side{face.normal, face.offset};
  std::array<Vec3, 4> places;
  const int count = nearest_of_rim(side, rim, {pair.level[0], pair.level[1]}, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const double height = face.normal.dot(places[k]) - face.offset;
    out[k] = {places[k], places[k] - height * face.normal, -face.normal, height};
  }
  return count;
}

}  // namespace

// A cylinder and the body beside the cylinder, at a pose of the tool, in the body's frame.
struct CylinderGaps::AtCylinder {
  AtCylinder(const RigidBodies& bodies, const Pair& pair, const View& tool, const Cylinder& seen) noexcept
      : ours(bodies.part(pair).cylinder.has_value()),
        round(ours ? pair.own : pair.other),
        feature(ours ? pair.other : pair.own),
        body(beside_cylinder(bodies.part(pair), bodies.entry(pair))),
        at(tool),
        cylinder(seen) {}

  // Returns a meeting as a touch in the object's frame.
  [[nodiscard]] Touch touch(const Meeting& meeting) const noexcept {
    if (ours) return {meeting.on_cylinder, -meeting.out, meeting.gap};
    return {at * meeting.on_other, at.R * meeting.out, meeting.gap};
  }
  // Returns the position of the cylinder's material point `place` for another pose of the tool, in the body's frame.
  [[nodiscard]] Vec3 elsewhere(const Vec3& place, const View& other) const noexcept {
    return ours ? other * at.to_T(place) : other.to_T(at * place);
  }

  bool ours;                     // the cylinder is a part of the tool
  std::uint32_t round, feature;  // index of the cylinder's rim or end; index of the body's corner, edge or face
  BesideCylinder body;
  View at;
  Cylinder cylinder;
};

int CylinderGaps::meet(const Pair& pair, const AtCylinder& here, double beside, Meetings& out) noexcept {
  const auto one = [&](const std::optional<Meeting>& meeting) {
    if (meeting) out[0] = *meeting;
    return meeting ? 1 : 0;
  };
  const BesideCylinder& body = here.body;
  switch (pair.kind) {
    case PairKind::side_point:
      return one(meet_side(here.cylinder, body.point(here.feature), body.radius(), beside));
    case PairKind::end_point:
      return one(meet_end(here.cylinder, here.round, body.point(here.feature), body.radius(), beside));
    case PairKind::rim_point:
      return one(meet_rim(here.cylinder, here.round, body.point(here.feature), body.radius()));
    case PairKind::side_edge:
      return one(meet_side(here.cylinder, body.edge(here.feature), body.radius(), beside));
    case PairKind::rim_edge: {
      std::array<Meeting, 2> places;
      const int count = meet_rim(here.cylinder, here.round, body.edge(here.feature), body.radius(), beside, places);
      std::copy_n(places.begin(), count, out.begin());
      return count;
    }
    default:
      return meet_face(pair, here.cylinder.rims[here.round], body.face(here.feature), out);
  }
}

// A meeting counts if its foot lies on the face, and if no other surface of the cylinder holds the place instead.
// Another surface holds the place if the place is less deep under that surface. For instance, a corner that lies on an
// end is also behind the cylinder's side.
bool CylinderGaps::counts(const Pair& pair, const AtCylinder& here, double beside,
                          const Meeting& meeting) const noexcept {
  if (pair.kind == PairKind::rim_face && !here.body.face(here.feature).over(meeting.on_cylinder, beside)) return false;
  if (!(meeting.gap < -kGap_m)) return true;
  // The centre of a round feature is outside of the cylinder, so the cylinder has one nearest feature.
  if (here.body.radius() > 0.0) return true;
  const Cylinder& cylinder = here.cylinder;
  const auto before = [&](std::uint32_t end) { return cylinder.before_end(end, meeting.on_other); };
  switch (pair.kind) {
    case PairKind::side_point:
    case PairKind::side_edge:
      return std::max(before(0), before(1)) <= meeting.gap;
    case PairKind::end_point: {
      const double across = cylinder.axis.cross(meeting.on_other - cylinder.from).norm();
      return std::max(before(1 - here.round), across - cylinder.radius) <= meeting.gap;
    }
    case PairKind::rim_face:
      if (here.body.mesh() != nullptr) return !was_behind_face(pair, here, meeting.on_cylinder);
      if (came_around(pair, here, meeting.on_cylinder)) return false;
      return here.body.highest_over_others(cylinder.rims[here.round], here.feature) <= meeting.gap;
    case PairKind::rim_edge:
      return !was_behind_edge(pair, here, meeting.on_cylinder);
    default:
      return true;
  }
}

// Whether a place of a rim was behind a mesh's face at the beginning of the part of the step without having gone
// through the face: the place was further behind than the sides reach, or its foot lay on the face.
bool CylinderGaps::was_behind_face(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const Vec3 was = here.elsewhere(place, sides_->tool_at_start(*bodies_, pair));
  const BesideCylinder::Face face = here.body.face(here.feature);
  const double height = face.normal.dot(was) - face.offset;
  if (height >= -kFront_m) return false;
  return height < -sides_->reach_m() || face.over(was);
}

// Whether a place of a rim came around an edge of a solid: at the beginning of the part of the step the place was
// behind the face, and now it is outside of the solid, in front of another face.
bool CylinderGaps::came_around(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const BesideCylinder::Face face = here.body.face(here.feature);
  return face.normal.dot(here.elsewhere(place, sides_->tool_at_start(*bodies_, pair))) - face.offset < -kFront_m &&
         is_outside(*here.body.solid(), place);
}

// Whether the edge was far behind the rim at the beginning of the part of the step, like an edge on the body's far
// side.
bool CylinderGaps::was_behind_edge(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept {
  const Solid::Rim& rim = here.cylinder.rims[here.round];
  const Vec2 in_rim((place - rim.centre).dot(rim.u), (place - rim.centre).dot(rim.v));
  const Cylinder was = seen_from_body(pair, sides_->tool_at_start(*bodies_, pair));
  return height_of_rim(was, here.round, here.body.edge(here.feature), in_rim) < -sides_->reach_m();
}

// Returns the cylinder in the frame of the body beside the cylinder.
Cylinder CylinderGaps::seen_from_body(const Pair& pair, const View& at) const noexcept {
  const std::optional<Cylinder>& own = bodies_->part(pair).cylinder;
  if (own) return moved(*own, at.R, at.x);
  const View to = inverse(at);
  return moved(*bodies_->entry(pair).cylinder, to.R, to.x);
}

const Cylinder& CylinderGaps::kept_cylinder(const Pair& pair, const View& at) noexcept {
  if (!cylinder_ || part_ != pair.part || entry_ != pair.entry) {
    part_ = pair.part;
    entry_ = pair.entry;
    cylinder_ = seen_from_body(pair, at);
  }
  return *cylinder_;
}

int CylinderGaps::touch(const Pair& pair, const View& at, double beside, Places& out) noexcept {
  if (is_of_two_cylinders(pair.kind)) return touch_two(pair, at, beside, out);
  const AtCylinder here(*bodies_, pair, at, kept_cylinder(pair, at));
  Meetings places;
  const int count = meet(pair, here, beside, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    out[k] = here.touch(places[k]);
    if (!counts(pair, here, beside, places[k])) out[k].gap = std::numeric_limits<double>::infinity();
  }
  return count;
}

FlatSide CylinderGaps::side_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept {
  if (pair.kind != PairKind::rim_face) return end_under_rim(pair, at, rim);
  const AtCylinder here(*bodies_, pair, at, seen_from_body(pair, at));
  const BesideCylinder::Face face = here.body.face(here.feature);
  rim = here.cylinder.rims[here.round];
  return {face.normal, face.offset};
}

}  // namespace proxarm::models
