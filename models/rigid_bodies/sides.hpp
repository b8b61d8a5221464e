// On which side of each feature the tool was where a step, or a part of it, began.
//
// A face or an edge holds the tool on the side on which it was at q(k−1). A side says nothing about a pose further away
// than it reaches.
#pragma once

#include <span>

#include "models/rigid_bodies/rigid_bodies.hpp"

namespace proxarm::models {

// Signed distance of a pair of point and face or of two edges, m, with the tool at a view in the object's frame: the
// height of the tool's feature over the object's, or of the object's point over the tool's face.
[[nodiscard]] double signed_height_m(const RigidBodies& bodies, const Pair& pair, const View& at) noexcept;

class Sides {
 public:
  // Writes each pair's side at q. The tool goes on by at most `far_m` in the part of the step that begins.
  void take(RigidBodies& bodies, std::span<Pair> pairs, const ToolPose& q, double far_m) noexcept;

  [[nodiscard]] const ToolPose& from() const noexcept { return from_; }
  // The tool where the sides were taken, in the frame of the pair's object.
  [[nodiscard]] View tool_at_start(const RigidBodies& bodies, const Pair& pair) const noexcept;
  // How far behind a feature the tool may be and still be held by it, m.
  [[nodiscard]] double reach_m() const noexcept { return reach_m_; }
  // How far the tool has come since, relative to what it may meet, m.
  [[nodiscard]] double came_m(const RigidBodies& bodies, const ToolPose& pose) const noexcept;
  // Whether a tool's point that is now at p, on the other side of a mesh's face than before, went through that face:
  // its way meets the plane on the triangle. Otherwise it came around.
  [[nodiscard]] bool went_through(const RigidBodies& bodies, const Pair& pair, const Vec3& p) const noexcept;

 private:
  ToolPose from_;
  double reach_m_ = kFront_m;
};

}  // namespace proxarm::models
