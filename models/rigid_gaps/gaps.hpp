// Computes the gaps of a pair of features at a pose. The only state is the cylinder that is kept from one pair to the
// next.
#pragma once

#include <array>
#include <optional>

#include "models/rigid_cylinder/cylinder_gaps.hpp"
#include "models/rigid_gaps/attempt.hpp"

namespace proxarm::models {

// Computes gaps at one pose of the tool. Each View transforms from T into the frame of the pair's object, and touches
// are in the object's frame.
class Gaps {
 public:
  using Places = CylinderGaps::Places;

  Gaps(const RigidBodies& bodies, const Sides& sides) noexcept
      : bodies_(&bodies), sides_(&sides), cylinders_(bodies, sides) {}

  // Returns where a pair's features touch or may touch; nothing if no foot lies on the other feature. `beside`: how far
  // beside a feature a foot may lie, m. Precondition: !has_several_places(pair.kind).
  [[nodiscard]] std::optional<Touch> touch_of(const Pair& pair, const View& at, double beside) const noexcept;
  // Does the same for a pair that pressed in the last solution. The foot may lie up to feet.over beyond a valley or an
  // edge's end.
  //
  // Reason: if an edge of the tool lies on a vertex, some nanometres between two iterates decide which of the vertex's
  // edges it crosses. Without this function the edge that it no longer crossed wasn't found, nothing held the tool at
  // the vertex, and the tool moved on by half a millimetre, until something else held it.
  [[nodiscard]] std::optional<Touch> touch_over(const Pair& pair, const View& at, const FootReach& feet) const noexcept;
  // Writes the places where a pair's features touch or may touch, and returns their number. Precondition:
  // has_several_places(pair.kind).
  [[nodiscard]] int touches_of(const Pair& pair, const View& at, double beside, Places& out) noexcept;
  // Whether a point that was behind a face of a convex solid at the beginning, and still is, lies in front of another
  // face of the solid. The point is then outside of the solid, and the first face doesn't hold it. (Next to a tip of a
  // solid, faces of its far side are near.)
  [[nodiscard]] bool is_beyond_edge(const Pair& pair, double gap, const View& at) const noexcept;
  // Keeps the direction of a rim's lowest point over a flat surface. While the rim lies level, this direction is used
  // for its first place. Precondition: is_flat_rim(pair.kind).
  void remember_lowest(Pair& pair, const View& at) const noexcept;

 private:
  [[nodiscard]] Touch in_field(const Pair& pair, const View& at) const noexcept;
  [[nodiscard]] int rim_in_field(const Pair& pair, const View& at, Places& out) const noexcept;
  [[nodiscard]] std::optional<Touch> between_features(const Pair& pair, const View& at, double beside) const noexcept;
  [[nodiscard]] std::optional<Touch> point_face(const Pair& pair, const View& at, double beside) const noexcept;
  [[nodiscard]] std::optional<Touch> face_point(const Pair& pair, const View& at, double beside) const noexcept;
  [[nodiscard]] std::optional<Touch> sharp_edges(const Pair& pair, const View& at, double beside) const noexcept;
  [[nodiscard]] std::optional<Touch> over_valley(const Pair& pair, const View& at,
                                                 const FootReach& feet) const noexcept;

  const RigidBodies* bodies_;
  const Sides* sides_;
  CylinderGaps cylinders_;
};

}  // namespace proxarm::models
