// A step: from pose to pose until nothing moves, in as many parts as it takes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// A part of a step moves no point of the tool by more than this share of the least thickness of what may meet; features
// that were up to twice as far behind another one may come to lie before it, as where an edge leaves the end of one
// edge for the next, but never those of a far side.
constexpr double kPart = 0.2;
// A step may take so many poses; a local problem that has no solution, or none that is found, costs a hundred times
// what one at hand does. What is left then counts as unresolved: the tool goes as far as the parts of the step got.
constexpr int kBudget = 400, kPosesOfPart = 8, kBudgetOfPart = 50;
// And for each part of the step so many contacts more may be looked at.
constexpr int kWorkOfPart = 60;
// Twice that in a step of several parts, and once more for the last of them, whose forces are asked for.
constexpr int kWorkOfFar = 2400;
// A part that finds no forces may be left out where the next one finds some, but not two in a row: sides reach as far
// as two parts do.
constexpr int kMostLeftOut = 1;
// So many parts are made of one where it leads nowhere, or to a solution that gives energy.
constexpr int kFiner = 8;
constexpr int kFewer = 6;
constexpr int kWorkInside = 600;  // of hollow objects, where a look costs 0.5 µs and most steps take thirty
// Newton's iteration with the gaps' curvature: what comes before a step of this size needn't be exact. A local problem
// that is solved to this share of the last step leads as near.
constexpr double kRoughShare = 1e-5;
constexpr double kNear_m = 1e-9;
// What is further away than so many times the way to p̂ isn't looked at: a stiff coupling seldom yields by more than
// that way, to either side. Where it does, all is looked at.
constexpr double kWithin = 2.0;
// By how much normals may still turn in the last step, whose forces are those of normals before it: of 10 N that is a
// tenth of a nanonewton across.
constexpr double kTurned = 1e-11;
// A tool that rests among more contacts than hold it may have a solution at one pose and, for rounding, none at the
// next, or steps that don't get smaller than rounding of its forces makes them. After a step below this the first one
// is taken: normals are right to 1e-8 then.
constexpr double kRest_m = 1e-13;
// From such a pose on only a share of a step is taken where steps swing to and fro: where gaps bend, and later where
// two features don't hold together, of which either one leads to where only the other is found.
constexpr int kWhole = 3, kWholeFlat = 10;
constexpr double kLeastShare = 0.125;
// But not of steps that rounding makes, where contacts hold each other: 1e-17 m of their gaps are 1e7 times that in the
// local problem's forces, and friction turns some of it into a way (contact_problem.cpp, kStiff).
constexpr double kNoise_m = 1e-11;
// From this pose on features count as far beside their ends as the last step went: two neighbours, of which either one
// leads to where only the other is found, then hold together. As steps become smaller so does this, and what is found
// in the end is theirs.
constexpr int kToAndFro = 6;
constexpr double kBesideAtMost_m = 1e-3;
// And at so many pairs of features, some 15 ns each: a step among hundreds of them took up to 50 ms.
constexpr int kLooks = 60000;

}  // namespace

// The share of a step that is taken, from that of the step before and both steps: what is left of a step along itself
// says how far the whole of it would have gone too far (Aitken's rule). The place of a contact that sticks may go far
// along two rods with next to no turn, and its friction's torque with it, of which the local problem knows nothing:
// whole steps then grow.
double RigidWorld::damped(double share, const Twist& delta, const Twist& last) const noexcept {
  const double lever2 = shared_->reach * shared_->reach;
  const auto product = [&](const Twist& a, const Twist& b) {
    return a.head<3>().dot(b.head<3>()) + lever2 * a.tail<3>().dot(b.tail<3>());
  };
  const double left = product(delta, last) / product(last, last);
  const bool grows = 1.0 - left > 2.0 * share;
  if (size_m(delta) <= kNoise_m && !grows) return 1.0;
  return left < 1.0 ? std::clamp(share / (1.0 - left), kLeastShare, 1.0) : kLeastShare;
}

// Of gaps.
double RigidWorld::rounding_m(const ToolPose& pose) const noexcept {
  return 4.0 * std::numeric_limits<double>::epsilon() * (pose.position.lpNorm<1>() + shared_->reach + extent_m_);
}

// From a pose on, until nothing moves.
bool RigidWorld::settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept {
  const double rounding = rounding_m(q);
  double last = std::numeric_limits<double>::infinity(), share = 1.0, rest = kRest_m;
  Twist last_delta = Twist::Zero();
  ToolPose resting;
  collected_ = false;
  bends_ = shared_->bends;
  for (int k = 0; k < 50; ++k) {
    if (--budget_ < 0 || looks_ < 0 || problem_.exhausted()) break;
    over_m_ = std::isfinite(last) ? std::clamp(last, beside_m, kBesideAtMost_m) : beside_m;
    beside_ = k < kToAndFro ? beside_m : over_m_;
    const Twist e = difference(q, p_hat);
    find(q, may_leave_out() ? kWithin * size_m(e) : kEverywhere_m);
    Twist delta;
    const bool roughly = bends_ && k > 0 && last > kNear_m;
    const double rough = roughly ? kRoughShare * std::min(last / motion(q, p_hat), 1.0) : 0.0;
    const double still_m = bends_ && !roughly && last < kNear_m ? rounding : 0.0;
    // (What moves may have gone on from under the tool since the part before.)
    const bool pressed = (k > 0 || something_comes()) && pressed_count_ > 0;
    const bool solved = solve_linear(q, e, q_old, rough, still_m, delta);
    let_loose_ = let_loose_ || (pressed && linear_count_ == 0);
    over_m_ = beside_m;
    if (!delta.allFinite() || (!solved && collected_) || overflow_) break;
    const double size = size_m(delta);
    if (linear_count_ == 0) {
      const bool there = q == p_hat;
      q = p_hat;
      if (there) {
        collected_ = false;  // what a pose before this one touched, it doesn't
        return true;
      }
      last = std::numeric_limits<double>::infinity();  // that wasn't a step of the iteration
      continue;
    }
    if (solved) balance(e, delta);
    if (k >= (bends_ ? kWhole : kWholeFlat) && std::isfinite(last)) share = damped(share, delta, last_delta);
    if (size <= kStill_m) share = 1.0;
    last_delta = delta;
    q = moved(q, share * delta);
    // What is left after this is the last ratio times this. Where gaps bend, this step counts as well: the forces are
    // those of normals before it.
    const bool on = on_features();
    const bool whole = share == 1.0 && !roughly && on && (!bends_ || size <= kStill_m);
    const bool small = std::isfinite(last) && size < 0.1 * last && size / last * size <= 0.1 * rounding &&
                       stays_balanced(delta, e) && normals_turn_by(delta) <= kTurned;
    const bool ends = whole && ((held_ && size <= kStill_m) || size <= rounding || small);
    const bool rests = solved && !roughly && on && size < rest;
    if ((ends || rests) && bar_what_reaches_beyond(q)) {
      last = std::numeric_limits<double>::infinity();
      let_loose_ = true;  // what it was barred from may have been all that held it
      continue;
    }
    if (ends) {
      collected_ = false;
      return solved;
    }
    if (rests) {
      rest = size;
      resting = q;
      collect_contacts(q);
    }
    last = size;
  }
  if (collected_) q = resting;
  return collected_;
}

// Where a part has no solution, another one may: none may take what the last one needs.
void RigidWorld::share_out(bool last) noexcept {
  budget_ = last ? kBudget : kBudgetOfPart;
  problem_.allow(last ? kWorkOfFar : 2 * kWorkOfPart);
}

bool RigidWorld::in_parts(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, ToolPose& q) noexcept {
  let_loose_ = false;
  if (something_comes() && parts > 1) return in_strides(p_hat, q_old, far, parts, q);
  overflow_ = squeezed_ = false;
  let_go(0.0);
  q = q_old;
  return go_on(p_hat, q_old, far / parts, parts, {1, parts}, q);
}

// From q, some of the parts, of each of which no point's way is more than `far`.
bool RigidWorld::go_on(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, const Range& range,
                       ToolPose& q) noexcept {
  const bool comes = something_comes();
  int left_out = 0;  // the parts just before this one
  set_sides(q, far);
  for (int k = range.first; k <= range.last; ++k) {
    if (crowded_) return false;  // what isn't known may be in the way
    const double share = static_cast<double>(k) / parts;
    q = let_go_with(q, share);
    const ToolPose p = k == parts ? p_hat : on_the_way(p_hat, q_old, share), from = q;
    if (comes || (k == parts && parts > 1)) share_out(k == parts);
    ToolPose next = comes ? along_with_holder(q) : q;
    if (settle(p, q_old, next)) {
      left_out = 0;
      let_loose_ = let_loose_ || motion(next, q) > 2.0 * far;  // past the sides' reach
      q = next;
      if (closely_ && gives_energy_at(q, from)) {
        q = from;
        if (!go_closely(p_hat, q_old, far, parts, k, q)) return false;
      }
    } else {
      // Only the last part's forces are asked for. Before it, any pose will do that leads through nothing.
      const bool may = comes || (k < range.last && left_out++ < kMostLeftOut);
      const bool on = may && (overflow_ = false, give_way(q)) && k < range.last;
      if (!on) return false;
    }
    if (k < parts) {
      if (came_m(q) > 0.5 * gathered_reach_) gather(q, gathered_reach_);
      set_sides(q, far);
    }
  }
  return true;
}

// One part, in smaller ones.
bool RigidWorld::go_closely(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, int part,
                            ToolPose& q) noexcept {
  closely_ = false;
  budget_ += kPosesOfPart * kFiner;
  allow_for(2 * kFiner);
  const bool led = go_on(p_hat, q_old, far / kFiner, kFiner * parts, {(part - 1) * kFiner + 1, part * kFiner}, q);
  closely_ = true;
  return led;
}

// The tool begins anew, elsewhere: nothing is known about where it is.
void RigidWorld::forget() noexcept {
  pair_count_ = pressed_count_ = 0;
  gathered_reach_ = -1.0;
  near_leaves_.forget();
  near_triangles_.forget();
}

const ToolPose& RigidWorld::step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept {
  advance(K, p_hat, q);
  for (Moving& m : moving_) m.mover.arrive();
  return q_;
}

void RigidWorld::advance(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept {
  count_ = 0;
  unresolved_ = overflow_ = squeezed_ = false;
  if (motion(q, q_) > kFront_m) forget();
  const double far = moving_.empty() ? motion(p_hat, q) : let_come(p_hat, q);
  if (clearance_ > 0.0 && came_m(q) + far < clearance_) {
    q_ = p_hat;
    return;
  }
  if (crowded_ || !(came_m(q) + 2.0 * far < gathered_reach_)) gather_for(q, far);
  clearance_ = -1.0;
  // (Where much was near, it may know of less than the step's way.)
  if (pair_count_ == 0 && came_m(q) + far < gathered_reach_) {
    clearance_ = gathered_reach_;
    q_ = p_hat;
    return;
  }
  K_ = K;
  problem_.set_stiffness(K);
  // (Where all that the step can come near is known, one part may go as far.)
  const bool all_known = !shared_->dense && came_m(q) + 2.0 * far < gathered_reach_;
  const double known = all_known ? gathered_reach_ : 0.25 * gathered_reach_;
  const double limit = std::min(kPart * shared_->thinness, known);
  const double wanted = std::max(std::ceil(far / limit), 1.0);
  // Among what moves strides lead over many parts at once.
  const bool whole = wanted <= (something_comes() ? kMostStrides : kMostParts);
  const int parts = whole ? static_cast<int>(wanted) : kMostParts;
  const ToolPose goal = whole ? p_hat : moved(q, difference(p_hat, q) * (kMostParts / wanted));
  budget_ = kBudget + kPosesOfPart * parts;
  looks_ = kLooks;
  fewer_ = kFewer;
  allow_for(parts);
  // (far shrinks with the goal only where nothing moves)
  const double to_goal = moving_.empty() && !whole ? motion(goal, q) : far;
  bool fine = in_parts(goal, q, to_goal, parts, q_) && !went_in(q);
  // What has used up what it may look at finds no more in smaller parts, nor without friction.
  const auto may = [&] { return looks_ > 0 || !something_comes(); };
  if (fine && gives_energy(q)) {
    if (may()) fine = look_closely(goal, q, to_goal, parts);
  } else if (!fine && budget_ > 0 && finer(parts) > 1 && may()) {
    fine = in_smaller_parts(goal, q, to_goal, parts, q_) && !went_in(q);
  }
  // Where no forces are found that keep all laws, friction is left out of this step. A tool that stayed where it is
  // would meet the same problem in the next one. In a hole it stays nevertheless, where a part of the step last kept
  // the law: there a jam is what most often has no solution, and without friction it would slip right through.
  const bool lawful = fine;
  if (!fine && !shared_->hollow && may()) {
    budget_ = kBudget;
    looks_ = something_comes() ? std::min(looks_, kLooks / 2) : kLooks / 2;
    problem_.allow(kWork);
    without_friction_ = true;
    const ToolPose reached = q_;
    const bool without_room = squeezed_;
    // The iteration may have gone by far in a part: in the dent of a mesh past a face that holds only over itself.
    fine = in_parts(goal, q, to_goal, parts, q_) && !(may_be_in() && stands_in(q_));
    without_friction_ = false;
    if (!fine) {
      q_ = reached;
      squeezed_ = without_room;
    }
  }
  if (!fine) went_in(q);  // in a part, of those that led nowhere
  beside_ = beside_m;
  unresolved_ = !lawful || !whole || overflow_ || crowded_;
  report(q);
}

// What the local problems of so many parts may cost.
void RigidWorld::allow_for(int parts) noexcept {
  problem_.allow((shared_->hollow ? kWorkInside : parts > 1 ? kWorkOfFar : kWork) + kWorkOfPart * parts);
}

// How many smaller parts are made of one. What comes fast takes many parts already.
int RigidWorld::finer(int parts) const noexcept {
  return something_comes() ? std::clamp(kMostParts / 2 / parts, 1, kFiner) : kFiner;
}

bool RigidWorld::in_smaller_parts(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts,
                                  ToolPose& q) noexcept {
  parts *= finer(parts);
  budget_ += kPosesOfPart * parts;
  allow_for(2 * parts);  // (of 192 along a corner each took 80 contacts)
  let_go(0.0);
  gather(q_old, gathered_reach_);
  return in_parts(p_hat, q_old, far, parts, q);
}

// Over an edge a step gives energy in smaller parts, too. But from so far before a wedge that an eighth of the step
// leads by it, the iteration may come to a solution beyond, where two vertices meet, say: an eighth that gives energy
// is looked at once more. (Found by the stress study, replay 5459542357847018, step 719.) False: smaller parts lead
// nowhere or into a mesh, and the tool stays where they led.
bool RigidWorld::look_closely(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts) noexcept {
  if (finer(parts) == 1) return true;
  closely_ = !something_comes();
  const bool led = in_smaller_parts(p_hat, q_old, far, parts, q_) && !went_in(q_old);
  closely_ = false;
  if (!led || !something_comes() || finer(kFiner * parts) == 1 || !gives_energy(q_old)) return led;
  return in_smaller_parts(p_hat, q_old, far, kFiner * parts, q_) && !went_in(q_old);
}

}  // namespace proxarm::models
