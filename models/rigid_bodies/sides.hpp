// Records on which side of each feature the tool was at the beginning of a step or of a part of a step.
//
// A face or an edge holds the tool on the side on which the tool was at that beginning. The recorded sides are valid
// only for poses within reach_m().
#pragma once

#include <span>

#include "models/rigid_bodies/rigid_bodies.hpp"

namespace proxarm::models {

// Returns the signed distance of a pair, m. The pair consists of a point and a face, or of two edges; `at` is the
// tool's pose in the object's frame. The result is the height of the tool's feature over the object's feature, or of
// the object's point over the tool's face.
[[nodiscard]] double signed_height_m(const RigidBodies& bodies, const Pair& pair, const View& at) noexcept;

class Sides {
 public:
  // Writes the side of each pair, with the tool at q. Precondition: in the part of the step that now begins, no point
  // of the tool moves by more than `far_m`.
  void take(RigidBodies& bodies, std::span<Pair> pairs, const ToolPose& q, double far_m) noexcept;

  [[nodiscard]] const ToolPose& from() const noexcept { return from_; }
  // Returns the tool's pose at which the sides were taken, in the frame of the pair's object.
  [[nodiscard]] View tool_at_start(const RigidBodies& bodies, const Pair& pair) const noexcept;
  // Returns how far behind a feature the tool may be so that the feature still holds the tool, m.
  [[nodiscard]] double reach_m() const noexcept { return reach_m_; }
  // Returns how far the tool has moved since the sides were taken, relative to the objects that it may meet, m.
  [[nodiscard]] double came_m(const RigidBodies& bodies, const ToolPose& pose) const noexcept;
  // Whether the pair's point of the tool, which is now at p, went through the pair's face of a mesh. If the point
  // changed sides, this means that the point's path meets the plane inside the triangle; otherwise the point came
  // around the triangle. True if the point didn't change sides or if the pair pressed.
  [[nodiscard]] bool went_through(const RigidBodies& bodies, const Pair& pair, const Vec3& p) const noexcept;

 private:
  ToolPose from_;
  double reach_m_ = kFront_m;
};

}  // namespace proxarm::models
