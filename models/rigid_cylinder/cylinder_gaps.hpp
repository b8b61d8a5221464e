// How near a feature of a cylinder is to a feature of another body, or of another cylinder.
//
// A cylinder and another body are seen from that body, whether the cylinder is the tool's part or the object.
#pragma once

#include <array>
#include <cstdint>

#include "models/rigid_bodies/sides.hpp"
#include "models/rigid_cylinder/beside_cylinder.hpp"
#include "models/rigid_shapes/cylinder.hpp"

namespace proxarm::models {

class CylinderGaps {
 public:
  using Places = std::array<Touch, 4>;

  CylinderGaps(const RigidBodies& bodies, const Sides& sides) noexcept : bodies_(&bodies), sides_(&sides) {}

  // The places where the two may touch, in the object's frame, with the tool at `at` in that frame. The gap is infinite
  // at a place that doesn't count. `beside`: how far beside a face or an edge's end a foot may lie. Returns their
  // number. A call for the same part and entry as the last one must have the same `at`.
  [[nodiscard]] int touch(const Pair& pair, const View& at, double beside, Places& out) noexcept;
  // The rim of a pair, and the flat side under it.
  [[nodiscard]] FlatSide side_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept;

 private:
  struct AtCylinder;
  struct TwoCylinders;
  using Meetings = std::array<Meeting, 4>;

  [[nodiscard]] Cylinder seen_from_body(const Pair& pair, const View& at) const noexcept;
  [[nodiscard]] const Cylinder& kept_cylinder(const Pair& pair, const View& at) noexcept;
  [[nodiscard]] static int meet(const Pair& pair, const AtCylinder& here, double beside, Meetings& out) noexcept;
  [[nodiscard]] bool counts(const Pair& pair, const AtCylinder& here, double beside,
                            const Meeting& meeting) const noexcept;
  [[nodiscard]] bool was_behind_face(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;
  [[nodiscard]] bool came_around(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;
  [[nodiscard]] bool was_behind_edge(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;

  [[nodiscard]] static int meet(const Pair& pair, const TwoCylinders& here, double beside, Meetings& out) noexcept;
  [[nodiscard]] bool counts(const Pair& pair, const TwoCylinders& here, const Meeting& meeting) const noexcept;
  [[nodiscard]] int touch_two(const Pair& pair, const View& at, double beside, Places& out) const noexcept;
  [[nodiscard]] FlatSide end_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept;

  const RigidBodies* bodies_;
  const Sides* sides_;
  // Many pairs of one part and entry follow each other: their cylinder is kept.
  bool known_ = false;
  std::uint16_t part_ = 0, entry_ = 0;
  Cylinder cylinder_;
};

}  // namespace proxarm::models
