// Computes the gaps between two cylinders, a part of the tool and an object, in the object's frame.
#include <algorithm>
#include <limits>

#include "models/rigid_cylinder/cylinder_gaps.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {

struct CylinderGaps::TwoCylinders {
  TwoCylinders(const RigidBodies& bodies, const Pair& pair, const View& at) noexcept
      : own(moved(*bodies.part(pair).cylinder, at.R, at.x)), other(*bodies.entry(pair).cylinder) {}

  Cylinder own, other;
};

// In all meetings `out` points out of the object, and on_other is a place on the tool.
int CylinderGaps::meet(const Pair& pair, const TwoCylinders& here, double beside, Meetings& out) noexcept {
  const Vec2 level(pair.level[0], pair.level[1]);
  int count = 0;
  switch (pair.kind) {
    case PairKind::sides:
      if (const std::optional<Meeting> meeting = meet_sides(here.other, here.own, beside)) {
        out[0] = *meeting;
        return 1;
      }
      return 0;
    case PairKind::rim_side:
      return meet_rim_and_side(here.other, here.own, pair.own, beside, out);
    case PairKind::rim_end:
      return meet_rim_and_end(here.other, pair.other, here.own, pair.own, level, beside, out);
    case PairKind::rims:
      return meet_rims(here.other, pair.other, here.own, pair.own, out);
    case PairKind::side_rim:
      count = meet_rim_and_side(here.own, here.other, pair.other, beside, out);
      break;
    default:
      count = meet_rim_and_end(here.own, pair.own, here.other, pair.other, level, beside, out);
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    std::swap(out[k].on_cylinder, out[k].on_other);
    out[k].out = -out[k].out;
  }
  return count;
}

// A meeting counts if the place isn't less deep under another surface, which would then hold the place instead.
bool CylinderGaps::counts(const Pair& pair, const TwoCylinders& here, const Meeting& meeting) const noexcept {
  if (!(meeting.gap < -kGap_m)) return true;
  const auto under_ends = [&](const Cylinder& cylinder, const Vec3& x) {
    return std::max(cylinder.before_end(0, x), cylinder.before_end(1, x)) <= meeting.gap;
  };
  const auto under_others = [&](const Cylinder& cylinder, std::uint32_t end, const Vec3& x) {
    const double across = cylinder.axis.cross(x - cylinder.from).norm();
    return std::max(cylinder.before_end(1 - end, x), across - cylinder.radius) <= meeting.gap;
  };
  switch (pair.kind) {
    case PairKind::sides:
      return under_ends(here.other, meeting.on_other) && under_ends(here.own, meeting.on_cylinder);
    case PairKind::rim_side:
      return under_ends(here.other, meeting.on_other);
    case PairKind::side_rim:
      return under_ends(here.own, meeting.on_cylinder);
    case PairKind::rim_end:
      return under_others(here.other, pair.other, meeting.on_other);
    case PairKind::end_rim:
      return under_others(here.own, pair.own, meeting.on_cylinder);
    default: {
      const Solid::Rim& rim = here.own.rims[pair.own];
      const Vec3 arm = meeting.on_other - rim.centre;
      const TwoCylinders was(*bodies_, pair, sides_->tool_at_start(*bodies_, pair));
      const Vec2 place(arm.dot(rim.u), arm.dot(rim.v));
      return !(height_of_rims(was.own, pair.own, was.other, pair.other, place) < -sides_->reach_m());
    }
  }
}

int CylinderGaps::touch_two(const Pair& pair, const View& at, double beside, Places& out) const noexcept {
  const TwoCylinders here(*bodies_, pair, at);
  Meetings places;
  const int count = meet(pair, here, beside, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    out[k] = {places[k].on_other, places[k].out, places[k].gap};
    if (!counts(pair, here, places[k])) out[k].gap = std::numeric_limits<double>::infinity();
  }
  return count;
}

FlatSide CylinderGaps::end_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept {
  const TwoCylinders here(*bodies_, pair, at);
  const bool ours = pair.kind == PairKind::rim_end;
  rim = ours ? here.own.rims[pair.own] : here.other.rims[pair.other];
  const Cylinder& under = ours ? here.other : here.own;
  const std::uint32_t end = ours ? pair.other : pair.own;
  const Vec3 n = under.out_of_end(end);
  return {n, n.dot(under.rims[end].centre)};
}

}  // namespace proxarm::models
