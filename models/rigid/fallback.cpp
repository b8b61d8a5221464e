#include "models/rigid/fallback.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace proxarm::models {
// Whether all gaps at a pose are at least 0, judged on the sides on which the tool was. False if the pose is beyond the
// reach of the sides.
bool Fallback::has_room(const ToolPose& pose) noexcept {
  if (state_->sides.came_m(state_->bodies, pose) > state_->sides.reach_m()) return false;
  search_.find(pose);
  const std::span<const Found> all = std::as_const(state_->touches).all();
  return !attempt_->overflow &&
         std::all_of(all.begin(), all.end(), [](const Found& found) { return found.touch.gap >= -kGap_m; });
}

bool Fallback::step_aside(ToolPose& q) noexcept {
  if (has_room(q)) return true;
  for (const MovingEntry& m : state_->bodies.moving()) {
    if (!m.close || m.mover.rests()) continue;
    const Placement& at = m.mover.at();
    const ToolPose with{at * m.from.x, Quaternion(Mat3(at.R * m.from.R)).normalized()};
    if (!has_room(with)) continue;
    q = with;
    return true;
  }
  attempt_->squeezed = true;
  return false;
}

// Returns q carried along with the holder: the moving object that pressed most on the tool. Returns q itself if a
// carrier already carries the tool, or if the pair that pressed most isn't with a moving object.
//
// If the tool is carried along with the holder, its gaps to the holder don't change, and each foot stays on its
// feature. If the tool stayed in W instead, the holder would move under it: the foot could then lie beyond an edge, and
// nothing, or only the face behind the edge, would hold the tool.
ToolPose Fallback::along_with_holder(const ToolPose& q) const noexcept {
  if (state_->bodies.has_carrier()) return q;
  const Pair* holder = nullptr;
  for (const Pair& pair : std::as_const(state_->candidates).all()) {
    if (!pair.pressed) continue;
    if (holder == nullptr || pair.force_W.squaredNorm() > holder->force_W.squaredNorm()) holder = &pair;
  }
  if (holder == nullptr || !state_->bodies.moves_now(holder->entry)) return q;
  const MovingEntry& m = state_->bodies.moving(holder->entry);
  return m.mover.at() * ToolPose{m.from.x, Quaternion(m.from.R)};
}

// A plane of contact mostly separates the tool from the object that it touches and from this object's neighbours. So
// these planes are tried first.
bool Fallback::stands_in(const ToolPose& pose) noexcept {
  std::array<Vec3, Overlaps::most_planes> normals;
  const LocalProblem& local = state_->local;
  const std::size_t count = std::min(local.count, normals.size());
  for (std::size_t k = 0; k < count; ++k) normals[k] = -state_->touches.found[local.touch_of[k]].touch.normal;
  return overlaps_.overlap_m(pose, {.enough = -kGap_m, .normals = {normals.data(), count}}) < -kGap_m;
}

// The tool may get into an object in two ways:
// 1. At a mesh's valley end, where the surface bends both ways, a corner of the tool may be behind faces while its foot
//    lies on none of them. Nothing then holds the corner.
// 2. Among solids, an iterate may have left all contacts that pressed in the iterate before, over an edge, while p̂ is
//    inside.
bool Fallback::take_back_if_in(const ToolPose& q_old, ToolPose& q) noexcept {
  if (!may_be_in()) return false;
  const bool approaches = state_->bodies.something_approaches();
  if (approaches) state_->bodies.move_to(1.0);  // to the end of the step, even if the tool's parts ended earlier
  if (!stands_in(q)) return false;
  q = approaches ? out_of_the_way(q_old, q) : q_old;
  return true;
}

// Returns the first of these poses at which the tool stands in no object: q_old; q_old carried along with one of the
// moving objects. If there is none, returns q, and the tool is squeezed.
ToolPose Fallback::out_of_the_way(const ToolPose& q_old, const ToolPose& q) noexcept {
  if (!stands_in(q_old)) return q_old;
  for (const MovingEntry& m : state_->bodies.moving()) {
    if (!m.close || m.mover.rests()) continue;
    const ToolPose with = m.mover.at() * m.mover.was().back(q_old);
    if (!stands_in(with)) return with;
  }
  attempt_->squeezed = true;
  return q;
}

}  // namespace proxarm::models
