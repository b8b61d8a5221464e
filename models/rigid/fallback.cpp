#include "models/rigid/fallback.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace proxarm::models {
// Whether the tool may be at a pose, by the sides on which it was: no gap is below 0. Sides say nothing about a pose
// further away than they reach.
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

// On the holder gaps are what they were, and feet lie on their features. Seen from where the tool stays in W, the
// holder has moved on by the object's way: its foot may be beyond an edge by that, so that nothing holds the tool, or
// what is behind the edge does.
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

// Objects that the tool touches are mostly on the other side of a plane through a contact, and so are their neighbours:
// those planes are tried first.
bool Fallback::stands_in(const ToolPose& pose) noexcept {
  std::array<Vec3, Overlaps::most_planes> normals;
  const LocalProblem& local = state_->local;
  const std::size_t count = std::min(local.count, normals.size());
  for (std::size_t k = 0; k < count; ++k) normals[k] = -state_->touches.found[local.touch_of[k]].touch.normal;
  return overlaps_.overlap_m(pose, {.enough = -kGap_m, .normals = {normals.data(), count}}) < -kGap_m;
}

// Where a mesh bends both ways, as at a valley's end, a corner of the tool may be behind faces and have its foot on
// none of them: nothing then holds it, and it would go in, though all else rests where it did. And among solids an
// iterate may have left all that pressed in the one before, over an edge, while p̂ is inside.
bool Fallback::take_back_if_in(const ToolPose& q_old, ToolPose& q) noexcept {
  if (!may_be_in()) return false;
  const bool approaches = state_->bodies.something_approaches();
  if (approaches) state_->bodies.move_to(1.0);  // all the way, though the tool's parts may have ended before
  if (!stands_in(q)) return false;
  q = approaches ? out_of_the_way(q_old, q) : q_old;
  return true;
}

// Where the tool was, or where that is on an object that moves: the first pose that isn't in anything. If there is
// none, it stays where it is, and has no room there.
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
