#include "models/rigid/iteration.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

constexpr int kMostPoses = 50;
// With bends (bends.hpp) the iteration is Newton's method. While its last step is longer than kNear_m, a local problem
// is solved only to kRoughShare of that step. An exact solution wouldn't come nearer to the fixed point.
constexpr double kRoughShare = 1e-5;
constexpr double kNear_m = 1e-9;
// Pairs further away than this many times the distance from q to p̂ aren't looked at, because a stiff coupling rarely
// yields by more than this distance. If it does, all pairs are looked at.
constexpr double kWithin = 2.0;
// Largest turn of the normals in the last step of the iteration, rad. The reported forces belong to the normals before
// this step. With 10 N the error is a tenth of a nanonewton.
constexpr double kTurned = 1e-11;
// A tool may rest among more contacts than are needed to hold it. Because of rounding, the local problem may then have
// a solution at one pose and none at the next pose, or the steps may not get smaller. So a solution is kept once a step
// is below this size; the normals are then correct to 1e-8.
constexpr double kRest_m = 1e-13;
// From the pose with this number on, only a share of a step is taken if the steps swing to and fro. kWhole is for
// problems with bends. kWholeFlat is for problems without bends; their steps swing if each of two features leads to a
// pose where only the other feature is found.
constexpr int kWhole = 3, kWholeFlat = 10;
constexpr double kLeastShare = 0.125;
// Steps below this size are taken whole, because they come from rounding. Where contacts press against each other, the
// local problem multiplies a rounding of 1e-17 m in the gaps by 1e7, and friction turns some of this into a motion
// (contact_problem.cpp, kStiff).
constexpr double kNoise_m = 1e-11;
// From the pose with this number on, a foot may lie beside its feature by up to the size of the last step. If each of
// two neighbouring features leads to a pose where only the other is found, both features then count together. The reach
// shrinks with the steps, so in the end both feet lie on their features.
constexpr int kToAndFro = 6;
constexpr double kBesideAtMost_m = 1e-3;

}  // namespace

// Returns the share of a step that is taken, by Aitken's rule: `share` is the share taken of the step before, and the
// component of the step `delta` along the step `last` shows by how much a whole step would have overshot.
//
// Damping is needed for two rods that stick to each other. A very small turn may move their place of contact far along
// the rods, and this changes the torque of the friction. The local problem doesn't contain this change, so whole steps
// would grow.
double Iteration::damped(double share, const Twist& delta, const Twist& last) const noexcept {
  const double reach_m = state_->bodies.setup().reach_m, lever2 = reach_m * reach_m;
  const auto product = [&](const Twist& a, const Twist& b) {
    return a.head<3>().dot(b.head<3>()) + lever2 * a.tail<3>().dot(b.tail<3>());
  };
  const double left = product(delta, last) / product(last, last);
  const bool grows = 1.0 - left > 2.0 * share;
  if (state_->bodies.size_m(delta) <= kNoise_m && !grows) return 1.0;
  return left < 1.0 ? std::clamp(share / (1.0 - left), kLeastShare, 1.0) : kLeastShare;
}

bool Iteration::settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept {
  Progress at{.rounding_m = state_->bodies.rounding_m(q), .rest_m = kRest_m};
  state_->contacts.drop_collected();
  attempt_->bends = state_->bodies.setup().bends;
  for (; at.k < kMostPoses; ++at.k) {
    if (--attempt_->poses_left < 0 || attempt_->looks_left < 0 || state_->local.problem.exhausted()) break;
    const Next next = iterate(p_hat, q_old, at, q);
    if (next == Next::stop) break;
    if (next == Next::iterate) continue;
    state_->contacts.drop_collected();
    return next == Next::solved;
  }
  if (state_->contacts.collected()) q = at.resting;
  return state_->contacts.collected();
}

Iteration::Next Iteration::iterate(const ToolPose& p_hat, const ToolPose& q_old, Progress& at, ToolPose& q) noexcept {
  FootReach& feet = attempt_->feet;
  feet.over = std::isfinite(at.last_m) ? std::clamp(at.last_m, beside_m, kBesideAtMost_m) : beside_m;
  feet.beside = at.k < kToAndFro ? beside_m : feet.over;
  const Twist e = difference(q, p_hat);
  local_step_.find(q, local_step_.may_leave_out() ? kWithin * state_->bodies.size_m(e) : Touches::everywhere_m);
  const bool roughly = attempt_->bends && at.k > 0 && at.last_m > kNear_m;
  const double rough = roughly ? kRoughShare * std::min(at.last_m / state_->bodies.motion_m(q, p_hat), 1.0) : 0.0;
  const double still_m = attempt_->bends && !roughly && at.last_m < kNear_m ? at.rounding_m : 0.0;
  // In the first iterate, contacts of the step's previous part count only if some object moves, since that object may
  // have left the tool.
  const bool pressed = (at.k > 0 || state_->bodies.something_approaches()) && state_->candidates.pressed.count > 0;
  Twist delta;
  const bool solved = local_step_.solve(q, e, q_old, rough, still_m, delta);
  const bool free = state_->local.count == 0;
  attempt_->lost_contact = attempt_->lost_contact || (pressed && free);
  feet.over = beside_m;
  if (!delta.allFinite() || (!solved && state_->contacts.collected()) || attempt_->overflow) return Next::stop;
  return free ? leave(p_hat, at, q) : go_on(e, delta, solved, roughly, at, q);
}

// Moves the tool to p̂, since nothing holds it.
Iteration::Next Iteration::leave(const ToolPose& p_hat, Progress& at, ToolPose& q) noexcept {
  if (q == p_hat) return Next::solved;
  q = p_hat;
  at.last_m = std::numeric_limits<double>::infinity();
  return Next::iterate;
}

Iteration::Next Iteration::go_on(const Twist& e, const Twist& solution, bool solved, bool roughly, Progress& at,
                                 ToolPose& q) noexcept {
  Twist delta = solution;
  const double size = state_->bodies.size_m(delta);
  if (solved) local_step_.balance(e, delta);
  if (at.k >= (attempt_->bends ? kWhole : kWholeFlat) && std::isfinite(at.last_m)) {
    at.share = damped(at.share, delta, at.last_delta);
  }
  if (size <= kStill_m) at.share = 1.0;
  at.last_delta = delta;
  q = moved(q, at.share * delta);
  // The motion that remains after this step is about the step times the last ratio of two steps. With bends the size of
  // the step matters as well, because the forces belong to the normals before the step.
  const bool on = local_step_.on_features();
  const bool whole = at.share == 1.0 && !roughly && on && (!attempt_->bends || size <= kStill_m);
  const bool small = std::isfinite(at.last_m) && size < 0.1 * at.last_m &&
                     size / at.last_m * size <= 0.1 * at.rounding_m && local_step_.stays_balanced(delta, e) &&
                     local_step_.normals_turn_by(delta) <= kTurned;
  const bool ends = whole && ((state_->local.kept && size <= kStill_m) || size <= at.rounding_m || small);
  const bool rests = solved && !roughly && on && size < at.rest_m;
  if ((ends || rests) && local_step_.bar_what_reaches_beyond(q)) {
    at.last_m = std::numeric_limits<double>::infinity();
    attempt_->lost_contact = true;  // the barred pair may have been the only pair that held the tool
    return Next::iterate;
  }
  if (ends) return solved ? Next::solved : Next::unsolved;
  if (rests) {
    at.rest_m = size;
    at.resting = q;
    collect_contacts(q);
  }
  at.last_m = size;
  return Next::iterate;
}

void Iteration::collect_contacts(const ToolPose& pose) noexcept {
  state_->contacts.collect(state_->bodies, state_->candidates, state_->touches, state_->local, pose);
}

void Iteration::drop_contacts() noexcept {
  local_step_.drop_contacts();
  state_->contacts.drop_collected();
}

}  // namespace proxarm::models
