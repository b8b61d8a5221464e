// Measures whether the tool stands in an object. It compares whole bodies instead of pairs of features.
//
// This is needed because gaps of features are valid only on the side on which the tool was. If the tool is inside a
// solid or stands in a surface, gaps don't show it.
#pragma once

#include "models/rigid_features/mesh_overlap.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

class Overlaps {
 public:
  static constexpr std::size_t most_planes = 8;  // planes to try first; a tool is held by fewer contacts

  Overlaps(const RigidBodies& bodies, const Candidates& candidates, LastPlanes& last_planes) noexcept
      : bodies_(&bodies), candidates_(&candidates), last_planes_(&last_planes) {}

  // Returns how deep the tool at a pose stands in an object, negative, m; +infinity if it stands in no object. Only
  // close objects count. If the tool is on the wrong side of a mesh, the result is minus the distance from the surface.
  [[nodiscard]] double overlap_m(const ToolPose& pose, const Apart& apart = {}) noexcept;

 private:
  [[nodiscard]] double of_near_leaves(std::uint16_t part, std::uint16_t entry, const View& at) const noexcept;

  const RigidBodies* bodies_;
  const Candidates* candidates_;
  LastPlanes* last_planes_;
};

}  // namespace proxarm::models
