#include "models/rigid/rigid_step.hpp"

#include <algorithm>
#include <cmath>

#include "models/rigid/budget.hpp"
#include "models/rigid_pairs/gathering.hpp"

namespace proxarm::models {
namespace {

// A part of a step moves each point of the tool by at most this share of the thickness of the thinnest part or object.
// The sides reach twice as far as this motion, so that a feature still counts when an edge passes from the end of one
// edge to the next. They never reach to features on a body's far side.
constexpr double kPart = 0.2;
constexpr int kMostPartsOfMoving = 1 << 16;  // with moving objects, because batches take many parts at once
constexpr int kRetries = 6;

}  // namespace

void RigidStep::take(const Mat6& K, const ToolPose& p_hat, ToolPose q_old) noexcept {
  RigidBodies& bodies = state_->bodies;
  state_->contacts.clear();
  state_->unresolved = state_->squeezed = false;
  if (bodies.motion_m(q_old, state_->q) > kFront_m) state_->candidates.forget();
  const double far_m = bodies.moving().empty() ? bodies.motion_m(p_hat, q_old) : bodies.begin_step(p_hat, q_old);
  if (passes_freely(q_old, far_m)) {
    state_->q = p_hat;
    return;
  }
  state_->local.K = K;
  state_->local.problem.set_stiffness(K);
  const Plan planned = plan(p_hat, q_old, far_m);
  allow(planned);
  const Way way{planned.goal, q_old, planned.far_m, planned.parts};
  const bool lawful = take_lawfully(way);
  if (!lawful) take_without_friction(way);
  state_->unresolved = !lawful || !planned.whole || attempt_.overflow || state_->candidates.crowded;
  state_->squeezed = attempt_.squeezed;
  if (!state_->contacts.collected()) iteration_.collect_contacts(state_->q);
  state_->contacts.judge_slips(bodies, q_old, state_->q);
}

// Whether no object comes near the tool in this step. Gathers the pairs anew if the tool has moved too far since the
// last gathering.
bool RigidStep::passes_freely(const ToolPose& q_old, double far_m) noexcept {
  const Candidates& candidates = state_->candidates;
  double came = candidates.came_m(state_->bodies, q_old);
  if (state_->empty_around_m > 0.0 && came + far_m < state_->empty_around_m) return true;
  if (candidates.crowded || !(came + 2.0 * far_m < candidates.gathered_reach_m)) {
    Gathering(state_->bodies, state_->candidates).gather_for(q_old, far_m);
    came = candidates.came_m(state_->bodies, q_old);
  }
  state_->empty_around_m = -1.0;
  // If many features are near, the reach of the pairs may be smaller than the motion of the step.
  if (candidates.count != 0 || !(came + far_m < candidates.gathered_reach_m)) return false;
  state_->empty_around_m = candidates.gathered_reach_m;
  return true;
}

RigidStep::Plan RigidStep::plan(const ToolPose& p_hat, const ToolPose& q_old, double far_m) const noexcept {
  const RigidBodies& bodies = state_->bodies;
  const double reach = state_->candidates.gathered_reach_m;
  // If the pairs contain all features that the step can come near, a part may be as long as the reach.
  const bool all_known = !bodies.setup().dense && state_->candidates.came_m(bodies, q_old) + 2.0 * far_m < reach;
  const double limit = std::min(kPart * bodies.setup().thinness_m, all_known ? reach : 0.25 * reach);
  const double wanted = std::max(std::ceil(far_m / limit), 1.0);
  Plan plan{.goal = p_hat, .far_m = far_m};
  plan.whole = wanted <= (bodies.something_approaches() ? kMostPartsOfMoving : kMostParts);
  plan.parts = plan.whole ? static_cast<int>(wanted) : kMostParts;
  if (!plan.whole) {
    plan.goal = moved(q_old, difference(p_hat, q_old) * (kMostParts / wanted));
    // The nearer goal shortens the motion only if no object moves.
    if (bodies.moving().empty()) plan.far_m = bodies.motion_m(plan.goal, q_old);
  }
  return plan;
}

void RigidStep::allow(const Plan& plan) noexcept {
  attempt_.poses_left = kPosesOfStep + kPosesOfPart * plan.parts;
  attempt_.looks_left = kLooks;
  attempt_.retries_left = kRetries;
  allow_for(plan.parts, *state_);
}

// Whether another attempt makes sense. A step among moving objects that has used up its looks would not get further in
// smaller parts or without friction.
bool RigidStep::may_look_on() const noexcept {
  return attempt_.looks_left > 0 || !state_->bodies.something_approaches();
}

// Returns false if no forces were found that keep all laws of contact.
bool RigidStep::take_lawfully(const Way& way) noexcept {
  ToolPose& q = state_->q;
  const bool led = in_parts_.take_outside(way, q);
  if (led && in_parts_.gives_energy(q, way.q_old)) return !may_look_on() || in_parts_.take_closely(way, q);
  if (led || attempt_.poses_left <= 0 || in_parts_.parts_of_part(way.parts) <= 1 || !may_look_on()) return led;
  return in_parts_.take_smaller(way, q);
}

// Takes the step without friction. If the tool stayed at its pose instead, the next step would meet the same problem.
// With hollow objects the tool stays nevertheless, at the last pose that kept the laws: a step in a hole mostly has no
// solution because of a jam, and without friction the tool would slip through the jam.
void RigidStep::take_without_friction(const Way& way) noexcept {
  const RigidBodies& bodies = state_->bodies;
  bool led = false;
  if (!bodies.setup().hollow && may_look_on()) {
    attempt_.poses_left = kPosesOfStep;
    attempt_.looks_left = bodies.something_approaches() ? std::min(attempt_.looks_left, kLooks / 2) : kLooks / 2;
    state_->local.problem.allow(LocalStep::kWork);
    attempt_.without_friction = true;
    const ToolPose reached = state_->q;
    const bool squeezed = attempt_.squeezed;
    // In one part, the iteration may have moved far: in a dent of a mesh, for instance, past a face that holds the tool
    // only if the foot lies on the face.
    led = in_parts_.take(way, state_->q) && !(fallback_.may_be_in() && fallback_.stands_in(state_->q));
    attempt_.without_friction = false;
    if (!led) {
      state_->q = reached;
      attempt_.squeezed = squeezed;
    }
  }
  if (!led) fallback_.take_back_if_in(way.q_old, state_->q);
}

}  // namespace proxarm::models
