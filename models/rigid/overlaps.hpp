// Whether the tool stands in an object, judged from whole bodies instead of pairs of features.
//
// Gaps of features hold on the side on which the tool was. Where it is inside of a solid, or stands in a surface, they
// say nothing.
#pragma once

#include "models/rigid_features/mesh_overlap.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

class Overlaps {
 public:
  static constexpr std::size_t most_planes = 8;  // to try first: more contacts than hold a tool

  Overlaps(const RigidBodies& bodies, const Candidates& candidates, LastPlanes& last_planes) noexcept
      : bodies_(&bodies), candidates_(&candidates), last_planes_(&last_planes) {}

  // How deep the tool stands in an object at a pose, m, negative; infinite if it stands in none. Only objects that are
  // close count. On the wrong side of a mesh it is the distance from the surface.
  [[nodiscard]] double overlap_m(const ToolPose& pose, const Apart& apart = {}) noexcept;

 private:
  [[nodiscard]] double of_near_leaves(std::uint16_t part, std::uint16_t entry, const View& at) const noexcept;

  const RigidBodies* bodies_;
  const Candidates* candidates_;
  LastPlanes* last_planes_;
};

}  // namespace proxarm::models
