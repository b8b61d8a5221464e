#include "models/rigid/clearance.hpp"

#include <algorithm>
#include <limits>

#include "models/rigid/overlaps.hpp"
#include "models/rigid_gaps/touch_search.hpp"

namespace proxarm::models {

double least_gap_m(RigidState& state, const ToolPose& pose) noexcept {
  constexpr double first_m = 1e-3, furthest_m = 1e6, nearest_m = 1e-9;
  Attempt attempt;
  TouchSearch search(state.bodies, state.candidates, state.sides, attempt, state.touches);
  Overlaps overlaps(state.bodies, state.candidates, state.last_planes);
  double least = std::numeric_limits<double>::infinity(), empty = 0.0;
  state.bodies.drop_carrier();
  for (double far = first_m; far < furthest_m && far > nearest_m;) {
    state.candidates.count = 0;  // no pair may count as pressed
    state.gather(pose, far);
    if (state.candidates.crowded) {  // search nearer; or return the largest distance that was found empty
      if (empty > 0.0) return std::min(empty, overlaps.overlap_m(pose));
      far *= 0.25;
      continue;
    }
    state.take_sides(pose, 0.0);
    search.find(pose);
    for (const Found& found : state.touches.all()) least = std::min(least, found.touch.gap);
    if (least < far) break;
    empty = far;
    far *= 4.0;
  }
  return std::min(least, overlaps.overlap_m(pose));
}

}  // namespace proxarm::models
