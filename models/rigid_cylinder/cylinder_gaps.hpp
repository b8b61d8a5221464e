// Computes the gaps between a feature of a cylinder and a feature of another body or of another cylinder.
//
// A cylinder and another body are compared in the frame of the other body, whether the cylinder is a part of the tool
// or the object.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/rigid_bodies/sides.hpp"
#include "models/rigid_cylinder/beside_cylinder.hpp"
#include "models/rigid_shapes/cylinder.hpp"

namespace proxarm::models {

class CylinderGaps {
 public:
  using Places = std::array<Touch, 4>;

  CylinderGaps(const RigidBodies& bodies, const Sides& sides) noexcept : bodies_(&bodies), sides_(&sides) {}

  // Writes the places where a pair's features may touch, in the object's frame, and returns their number. The gap is
  // infinite at a place that doesn't count. `at` is the tool's pose in the object's frame. `beside`: how far beside a
  // face or an edge's end a foot may lie, m. Precondition: consecutive calls for the same part and entry have the same
  // `at`.
  [[nodiscard]] int touch(const Pair& pair, const View& at, double beside, Places& out) noexcept;
  // Returns the flat side under the rim of a pair, and writes the rim; both are in one frame.
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
  // The cylinder of the last pair, in the body's frame. It is kept because many consecutive pairs have the same part
  // and entry.
  std::uint16_t part_ = 0, entry_ = 0;
  std::optional<Cylinder> cylinder_;
};

}  // namespace proxarm::models
