// Gaps of a pair of features at a pose: pure, but for the cylinder that is kept from one pair to the next.
#pragma once

#include <array>
#include <optional>

#include "models/rigid_cylinder/cylinder_gaps.hpp"
#include "models/rigid_gaps/attempt.hpp"

namespace proxarm::models {

// At one pose of the tool. Views lead from T to the frame of the pair's object, and touches are in that frame.
class Gaps {
 public:
  using Places = CylinderGaps::Places;

  Gaps(const RigidBodies& bodies, const Sides& sides) noexcept
      : bodies_(&bodies), sides_(&sides), cylinders_(bodies, sides) {}

  // The places where the two touch or may touch. Returns their number; 0 if no foot lies on the other feature.
  // `beside`: how far beside a feature a foot may lie.
  [[nodiscard]] int evaluate(const Pair& pair, const View& at, double beside, Places& out) noexcept;
  // The same for a pair that pressed in the last solution, up to `over` beyond a valley or an edge's end.
  //
  // An edge of the tool that lies on a vertex crosses one edge there or another one, as an iterate has it by
  // nanometres. The edge that it left wasn't found, nothing held the tool there any more, and it went on by half a
  // millimetre, to where something else held it.
  [[nodiscard]] int evaluate_over(const Pair& pair, const View& at, const FootReach& feet, Places& out) noexcept;
  // Whether a point that comes from behind a face of a convex solid is still before another one of its faces: then it
  // is outside, and is not held by the face that it is deep under. Next to a tip the far side is near.
  [[nodiscard]] bool is_beyond_edge(const Pair& pair, double gap, const View& at) const noexcept;
  // Keeps where a rim over something flat is lowest: while it lies level, that says where it would tip. Precondition:
  // is_flat_rim(pair.kind).
  void remember_lowest(Pair& pair, const View& at) const noexcept;

 private:
  int evaluate_field(const Pair& pair, const View& at, Places& out) const noexcept;
  [[nodiscard]] std::optional<Touch> evaluate_one(const Pair& pair, const View& at, double beside) const noexcept;
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
