#include "models/rigid/step_in_parts.hpp"

#include <algorithm>

#include "models/rigid/budget.hpp"
#include "models/rigid/step_in_batches.hpp"

namespace proxarm::models {
namespace {

// Number of consecutive parts without forces that may be left out if the next part finds forces. One, because the sides
// reach as far as two parts lead.
constexpr int kMostLeftOut = 1;
// A part without a solution, or with a solution that gives energy, is divided into this many parts.
constexpr int kFiner = 8;

}  // namespace

bool StepInParts::take(const Way& way, ToolPose& q) noexcept {
  attempt_->lost_contact = attempt_->overflow = attempt_->squeezed = false;
  if (state_->bodies.something_approaches() && way.parts > 1) {
    StepInBatches batches(*state_, *attempt_, *iteration_, *fallback_, way);
    const bool led = batches.take();
    q = batches.reached();
    return led;
  }
  state_->bodies.move_to(0.0);
  q = way.q_old;
  return take_parts(way, way.each_m(), {1, way.parts}, q);
}

// Takes the parts of `range`, starting from q. In each part no point moves by more than `each_m`. Returns false if some
// part had no solution.
bool StepInParts::take_parts(const Way& way, double each_m, const Range& range, ToolPose& q) noexcept {
  const bool approaches = state_->bodies.something_approaches();
  int left_out = 0;  // number of parts just before this part that were left out
  state_->take_sides(q, each_m);
  for (int k = range.first; k <= range.last; ++k) {
    if (state_->candidates.crowded) return false;  // a pair that wasn't gathered may be in the way
    q = state_->bodies.carry_to(q, way.share(k));
    const ToolPose p = way.goal(state_->bodies, k), from = q;
    if (approaches || (k == way.parts && way.parts > 1)) allow_part(k == way.parts, *state_, *attempt_);
    ToolPose next = approaches ? fallback_->along_with_holder(q) : q;
    if (iteration_->settle(p, way.q_old, next)) {
      left_out = 0;
      const bool past_sides = state_->bodies.motion_m(next, q) > 2.0 * each_m;
      attempt_->lost_contact = attempt_->lost_contact || past_sides;
      q = next;
      if (attempt_->refines && gives_energy(q, from)) {
        q = from;
        if (!take_part_closely(way, each_m, k, q)) return false;
      }
    } else {
      // Only the forces of the last part are reported. Before it, any pose to which the tool comes without passing
      // through an object is good enough.
      const bool may = approaches || (k < range.last && left_out++ < kMostLeftOut);
      if (!may) return false;
      attempt_->overflow = false;
      if (!fallback_->step_aside(q) || k == range.last) return false;
    }
    if (k < way.parts) {
      state_->gather_if_far(q);
      state_->take_sides(q, each_m);
    }
  }
  return true;
}

// Takes one part, divided into smaller parts.
bool StepInParts::take_part_closely(const Way& way, double each_m, int part, ToolPose& q) noexcept {
  attempt_->refines = false;
  attempt_->poses_left += kPosesOfPart * kFiner;
  allow_for(2 * kFiner, *state_);
  const Way finer_way{way.p_hat, way.q_old, way.far_m, kFiner * way.parts};
  const bool led = take_parts(finer_way, each_m / kFiner, {(part - 1) * kFiner + 1, part * kFiner}, q);
  attempt_->refines = true;
  return led;
}

int StepInParts::parts_of_part(int parts) const noexcept {
  return state_->bodies.something_approaches() ? std::clamp(kMostParts / 2 / parts, 1, kFiner) : kFiner;
}

bool StepInParts::take_outside(const Way& way, ToolPose& q) noexcept {
  return take(way, q) && !fallback_->take_back_if_in(way.q_old, q);
}

bool StepInParts::take_smaller(Way way, ToolPose& q) noexcept {
  way.parts *= parts_of_part(way.parts);
  attempt_->poses_left += kPosesOfPart * way.parts;
  allow_for(2 * way.parts, *state_);  // (measured: 80 contacts for each of 192 parts along a corner)
  state_->bodies.move_to(0.0);
  state_->gather(way.q_old, state_->candidates.gathered_reach_m);
  return take_outside(way, q);
}

// Takes a step again, in smaller parts, because its contacts gave energy. Returns false if smaller parts have no
// solution or lead into an object; the tool then stays at the pose that they reached.
//
// A step over an edge gives energy in smaller parts, too, and this is accepted. But if the step starts so far from a
// wedge that an eighth of the step passes the wedge, the iteration may find a solution on the far side, for instance
// where two vertices meet. So an eighth that gives energy is divided once more. (Found by the stress study, replay
// 5459542357847018, step 719.)
bool StepInParts::take_closely(const Way& way, ToolPose& q) noexcept {
  if (parts_of_part(way.parts) == 1) return true;
  const bool approaches = state_->bodies.something_approaches();
  attempt_->refines = !approaches;
  const bool led = take_smaller(way, q);
  attempt_->refines = false;
  Way smaller = way;
  smaller.parts *= kFiner;
  if (!led || !approaches || parts_of_part(smaller.parts) == 1 || !gives_energy(q, way.q_old)) return led;
  return take_smaller(smaller, q);
}

bool StepInParts::gives_energy(const ToolPose& q, const ToolPose& q_old) noexcept {
  if (!state_->contacts.collected()) iteration_->collect_contacts(q);
  return state_->contacts.give_energy(state_->bodies, q, q_old);
}

}  // namespace proxarm::models
