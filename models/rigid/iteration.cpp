#include "models/rigid/iteration.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

constexpr int kMostPoses = 50;
// Newton's iteration with bends: a solution before a step of kNear_m needn't be exact. A local problem that is solved
// to this share of the last step leads as near.
constexpr double kRoughShare = 1e-5;
constexpr double kNear_m = 1e-9;
// Pairs further away than this many times the way to p̂ aren't looked at: a stiff coupling rarely yields by more than
// that way, to either side. If it does, all pairs are looked at.
constexpr double kWithin = 2.0;
// By how much normals may still turn in the last step, rad, whose forces are those of normals before it: of 10 N that
// is a tenth of a nanonewton across.
constexpr double kTurned = 1e-11;
// A tool that rests among more contacts than hold it may have a solution at one pose and, for rounding, none at the
// next, or steps that rounding of its forces keeps from getting smaller. After a step below this size the first
// solution is taken: normals are right to 1e-8 then.
constexpr double kRest_m = 1e-13;
// From this pose on only a share of a step is taken if steps swing to and fro: with bends, and later if two features
// don't hold together, of which either one leads to where only the other is found.
constexpr int kWhole = 3, kWholeFlat = 10;
constexpr double kLeastShare = 0.125;
// But not of steps that rounding makes, where contacts hold each other: 1e-17 m of their gaps are 1e7 times that in the
// local problem's forces, and friction turns some of it into a way (contact_problem.cpp, kStiff).
constexpr double kNoise_m = 1e-11;
// From this pose on features count as far beside their ends as the last step went: two neighbours, of which either one
// leads to where only the other is found, then hold together. As steps become smaller so does this reach, and the
// solution in the end is theirs.
constexpr int kToAndFro = 6;
constexpr double kBesideAtMost_m = 1e-3;

}  // namespace

// The share of a step that is taken, from the share of the step before and both steps: the part of a step along the
// last one says how far the whole of that would have gone too far (Aitken's rule). The place of a contact that sticks
// may go far along two rods with next to no turn, and the torque of its friction with it, which the local problem
// doesn't know: whole steps then grow.
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
  // (An object may have moved on from under the tool since the part before.)
  const bool pressed = (at.k > 0 || state_->bodies.something_approaches()) && state_->candidates.pressed.count > 0;
  Twist delta;
  const bool solved = local_step_.solve(q, e, q_old, rough, still_m, delta);
  const bool free = state_->local.count == 0;
  attempt_->lost_contact = attempt_->lost_contact || (pressed && free);
  feet.over = beside_m;
  if (!delta.allFinite() || (!solved && state_->contacts.collected()) || attempt_->overflow) return Next::stop;
  return free ? leave(p_hat, at, q) : go_on(e, delta, solved, roughly, at, q);
}

// Nothing holds the tool on the way to p̂.
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
  // After this step the last ratio times it is left to go. With bends the step counts as well: its forces are those of
  // the normals before it.
  const bool on = local_step_.on_features();
  const bool whole = at.share == 1.0 && !roughly && on && (!attempt_->bends || size <= kStill_m);
  const bool small = std::isfinite(at.last_m) && size < 0.1 * at.last_m &&
                     size / at.last_m * size <= 0.1 * at.rounding_m && local_step_.stays_balanced(delta, e) &&
                     local_step_.normals_turn_by(delta) <= kTurned;
  const bool ends = whole && ((state_->local.kept && size <= kStill_m) || size <= at.rounding_m || small);
  const bool rests = solved && !roughly && on && size < at.rest_m;
  if ((ends || rests) && local_step_.bar_what_reaches_beyond(q)) {
    at.last_m = std::numeric_limits<double>::infinity();
    attempt_->lost_contact = true;  // the barred pair may have been all that held the tool
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
