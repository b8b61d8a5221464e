// Finds the touches of all candidate pairs at a pose.
#pragma once

#include "models/rigid_bodies/sides.hpp"
#include "models/rigid_gaps/attempt.hpp"
#include "models/rigid_gaps/touches.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

class Gaps;

class TouchSearch {
 public:
  TouchSearch(RigidBodies& bodies, Candidates& candidates, const Sides& sides, Attempt& attempt, Touches& out) noexcept
      : bodies_(&bodies), candidates_(&candidates), sides_(&sides), attempt_(&attempt), out_(&out) {}

  // Finds all touches at a pose, or only those that the tool may reach if it moves on by at most `within_m`.
  void find(const ToolPose& pose, double within_m = Touches::everywhere_m) noexcept;

 private:
  void look_at_pairs(const ToolPose& pose, double within_m) noexcept;
  void look_at(std::size_t index, const View& at, const MovingEntry* on, const ToolPose& pose, Gaps& gaps) noexcept;
  void add(const Touch& touch, std::size_t index, int which, const MovingEntry* on, const ToolPose& pose) noexcept;
  [[nodiscard]] bool needs_others(const Found& found) const noexcept;

  RigidBodies* bodies_;
  Candidates* candidates_;
  const Sides* sides_;
  Attempt* attempt_;
  Touches* out_;
};

}  // namespace proxarm::models
