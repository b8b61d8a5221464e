// A cylinder as a part of the tool and one as an object: which of their features may meet, and how near they are.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {
namespace {

// Whether a rim comes so near to the plane of another cylinder's end, and its middle so near to that end's.
bool comes_near_end(const Solid::Rim& rim, const Cylinder& other, std::uint32_t end, double near) noexcept {
  const double height = other.before_end(end, rim.centre);
  const double down = rim.radius * std::hypot(other.axis.dot(rim.u), other.axis.dot(rim.v));
  const Vec3 across = rim.centre - other.rims[end].centre - height * other.out_of_end(end);
  return std::abs(height) <= near + down && across.norm() <= rim.radius + other.radius + near;
}

}  // namespace

// At a pose of the tool, seen from the object.
struct RigidWorld::TwoCylinders {
  TwoCylinders(const RigidWorld& world, std::uint16_t part, std::uint16_t entry, const View& at) noexcept
      : own(moved(*world.shared_->parts[part].cylinder, at.R, at.x)), other(*world.shared_->entries[entry].cylinder) {}

  Cylinder own, other;
};

void RigidWorld::gather_cylinders(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const TwoCylinders here(*this, part, entry, at);
  const auto add = [&](Kind kind, std::uint32_t own, std::uint32_t other) {
    add_pair(kind, part, entry, own, other, 0.0);
  };
  const EdgeLine own = axis_of(here.own), other = axis_of(here.other);
  const double most = reach + here.own.radius + here.other.radius;
  if (distance2_of_segments(own, other) > most * most) return;
  add(Kind::sides, 0, 0);
  for (const std::uint32_t i : {0U, 1U}) {
    if (distance2_to_segment(here.own.rims[i].centre, other) <= most * most) add(Kind::rim_side, i, 0);
    if (distance2_to_segment(here.other.rims[i].centre, own) <= most * most) add(Kind::side_rim, 0, i);
    for (const std::uint32_t j : {0U, 1U}) {
      const bool own_near = comes_near_end(here.own.rims[i], here.other, j, reach);
      const bool other_near = comes_near_end(here.other.rims[j], here.own, i, reach);
      if (own_near) add(Kind::rim_end, i, j);
      if (other_near) add(Kind::end_rim, i, j);
      if (own_near && other_near) add(Kind::rims, i, j);
    }
  }
}

// Each is out of the object, on_other a place of the tool.
int RigidWorld::meet(const Pair& pair, const TwoCylinders& here, std::array<Meeting, 4>& out) const noexcept {
  const Vec2 level(pair.level[0], pair.level[1]);
  int count = 0;
  switch (pair.kind) {
    case Kind::sides:
      if (const std::optional<Meeting> meeting = meet_sides(here.other, here.own, beside_)) {
        out[0] = *meeting;
        return 1;
      }
      return 0;
    case Kind::rim_side:
      return meet_rim_and_side(here.other, here.own, pair.own, beside_, out);
    case Kind::rim_end:
      return meet_rim_and_end(here.other, pair.other, here.own, pair.own, level, beside_, out);
    case Kind::rims:
      return meet_rims(here.other, pair.other, here.own, pair.own, out);
    case Kind::side_rim:
      count = meet_rim_and_side(here.own, here.other, pair.other, beside_, out);
      break;
    default:
      count = meet_rim_and_end(here.own, pair.own, here.other, pair.other, level, beside_, out);
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    std::swap(out[k].on_cylinder, out[k].on_other);
    out[k].out = -out[k].out;
  }
  return count;
}

// As for a cylinder and a solid: what isn't less deep under another surface.
bool RigidWorld::counts(const Pair& pair, const TwoCylinders& here, const Meeting& meeting) const noexcept {
  if (!(meeting.gap < -kGap_m)) return true;
  const auto under_ends = [&](const Cylinder& cylinder, const Vec3& x) {
    return std::max(cylinder.before_end(0, x), cylinder.before_end(1, x)) <= meeting.gap;
  };
  const auto under_others = [&](const Cylinder& cylinder, std::uint32_t end, const Vec3& x) {
    const double across = cylinder.axis.cross(x - cylinder.from).norm();
    return std::max(cylinder.before_end(1 - end, x), across - cylinder.radius) <= meeting.gap;
  };
  switch (pair.kind) {
    case Kind::sides:
      return under_ends(here.other, meeting.on_other) && under_ends(here.own, meeting.on_cylinder);
    case Kind::rim_side:
      return under_ends(here.other, meeting.on_other);
    case Kind::side_rim:
      return under_ends(here.own, meeting.on_cylinder);
    case Kind::rim_end:
      return under_others(here.other, pair.other, meeting.on_other);
    case Kind::end_rim:
      return under_others(here.own, pair.own, meeting.on_cylinder);
    default: {
      const Solid::Rim& rim = here.own.rims[pair.own];
      const Vec3 arm = meeting.on_other - rim.centre;
      const TwoCylinders was(*this, pair.part, pair.entry, from_of(pair));
      const Vec2 place(arm.dot(rim.u), arm.dot(rim.v));
      return !(height_of_rims(was.own, pair.own, was.other, pair.other, place) < -behind_m_);
    }
  }
}

int RigidWorld::touch_cylinders(const Pair& pair, const View& at, std::array<Touch, 4>& out) const noexcept {
  const TwoCylinders here(*this, pair.part, pair.entry, at);
  std::array<Meeting, 4> places;
  const int count = meet(pair, here, places);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    out[k] = {places[k].on_other, places[k].out, places[k].gap};
    if (!counts(pair, here, places[k])) out[k].gap = std::numeric_limits<double>::infinity();
  }
  return count;
}

FlatSide RigidWorld::end_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept {
  const TwoCylinders here(*this, pair.part, pair.entry, at);
  const bool ours = pair.kind == Kind::rim_end;
  rim = ours ? here.own.rims[pair.own] : here.other.rims[pair.other];
  const Cylinder& under = ours ? here.other : here.own;
  const std::uint32_t end = ours ? pair.other : pair.own;
  const Vec3 n = under.out_of_end(end);
  return {n, n.dot(under.rims[end].centre)};
}

}  // namespace proxarm::models
