#include "models/rigid/local_step.hpp"

#include <algorithm>
#include <cmath>

#include "models/rigid_gaps/bends.hpp"
#include "models/rigid_gaps/deeper_touches.hpp"
#include "models/rigid_gaps/near_sides.hpp"

namespace proxarm::models {
namespace {

// Cost of a local problem for which no solution is found, in poses.
constexpr int kHard = 40;
// A contact whose force is below this share of the largest force may be left out if no other solution is found.
constexpr double kIdle = 1e-3;
// A contact joins the local problem only if δ passes it by more than this rounding.
constexpr double kPassed_m = 1e-16;
// If δ passes more than kFewPassed contacts, or if the setup is dense, only kAtATime contacts join in a round.
constexpr std::size_t kAtATime = 4, kFewPassed = 12;
// If there is no room for all contacts, a contact that δ passes by less than this (a hundredth of kGap_m) doesn't count
// as missing.
constexpr double kPassedAmongMany_m = 1e-14;
constexpr int kRounds = 16;
// With at least this many pairs, leaving out far pairs saves time.
constexpr std::size_t kManyPairs = 12;
// Largest relative error of the wrench's balance after the last step of the iteration: with 10 N, a third of 1e-10 N.
constexpr double kBalance = 3e-12;

// Returns the linearised gap of a touch after a twist.
double gap_after(const Found& found, const ToolPose& pose, const Twist& xi) noexcept {
  const Vec3 lever = found.touch.point - pose.position;
  return found.touch.gap + found.touch.normal.dot(xi.head<3>() + xi.tail<3>().cross(lever));
}

}  // namespace

Vec3 in_cone(Vec3 f, double mu) noexcept {
  f[0] = std::max(f[0], 0.0);
  const double size = f.tail<2>().norm(), limit = mu * f[0];
  if (size > limit) f.tail<2>() *= limit / size;
  return f;
}

void LocalStep::linearise(const Found& found, const ToolPose& pose, const ToolPose& q_old, LinearContact& out,
                          Mat3& axes) const noexcept {
  const Pair& pair = pair_of(found);
  const Vec3& n = found.touch.normal;
  axes.col(0) = n;
  axes.col(1) = n.unitOrthogonal();
  axes.col(2) = n.cross(axes.col(1));
  const Vec3 lever = found.touch.point - pose.position;
  for (int k = 0; k < 3; ++k) {
    out.J.row(k).head<3>() = axes.col(k);
    out.J.row(k).tail<3>() = lever.cross(axes.col(k));
  }
  const Vec3 slip = bodies_->slip_since_m(q_old, pair.entry, found.touch.point, pose);
  out.c << found.touch.gap, axes.col(1).dot(slip), axes.col(2).dot(slip);
  out.mu = attempt_->without_friction ? 0.0 : bodies_->friction(pair);
  const Vec3* force = nullptr;
  if (found.which == 0) {
    if (pair.pressed) force = &pair.force_W;
  } else if (const PressedPlaces::Place* last = candidates_->pressed.of(found.pair, found.which)) {
    force = &last->force_W;
  }
  out.f = force != nullptr ? Vec3(axes.transpose() * *force) : Vec3(Vec3::Zero());
}

// Returns the gap below which contacts join the local problem. If δ passes only few contacts and the setup isn't dense,
// this is -kPassed_m, so that all these contacts join.
// Reason: if a face comes down on a fine mesh, δ passes many vertices at once, and few of them will hold the face. (A
// prism with many sides that stands up on a table is similar.) So the contacts that δ passes by most join first,
// kAtATime in a round.
double LocalStep::worst_passed(const Twist& xi, const ToolPose& pose) const noexcept {
  std::array<double, kAtATime + 1> least;
  least.fill(-kPassed_m);
  std::size_t passed = 0;
  for (const Found& found : touches_->all()) {
    if (found.working) continue;
    double gap = gap_after(found, pose, xi);
    if (!(gap < -kPassed_m)) continue;
    ++passed;
    for (double& other : least) {
      if (gap < other) std::swap(gap, other);
    }
  }
  if (!bodies_->setup().dense && passed <= kFewPassed) return -kPassed_m;
  // δ may pass many contacts by exactly the same distance.
  return least.front() == least.back() ? std::nextafter(least.back(), 0.0) : least.back();
}

// Adds the contacts that δ passes to the local problem; in the first round also the contacts that pressed in the last
// solution. Returns false if there is none.
bool LocalStep::join(const ToolPose& pose, const ToolPose& q_old, const Twist& delta, bool first,
                     double still_m) noexcept {
  const double worst = worst_passed(delta, pose);
  const bool some = worst < -kPassed_m;  // not all passed contacts join in this round
  std::size_t joined = 0;
  const std::size_t before = local_->count;
  for (std::size_t i = 0; i < touches_->count; ++i) {
    Found& found = touches_->found[i];
    if (found.working) continue;
    const bool pressed = pair_of(found).pressed;
    const double gap = gap_after(found, pose, delta);
    const bool passed = gap < worst && (!some || joined < kAtATime);
    if (!passed && !(first && pressed)) continue;
    if (local_->count == ContactProblem::most) {
      attempt_->overflow = attempt_->overflow || gap < -kPassedAmongMany_m;
      continue;
    }
    if (passed) ++joined;
    found.working = true;
    local_->touch_of[local_->count] = static_cast<std::uint16_t>(i);
    LinearContact& linear = local_->contacts[local_->count];
    linearise(found, pose, q_old, linear, local_->axes[local_->count]);
    // The gap of a contact that pressed is set to exactly 0. Otherwise contacts that press against each other would get
    // forces from rounding.
    if (pressed && local_->lies_along && std::abs(linear.c[0]) <= still_m) linear.c[0] = 0.0;
    ++local_->count;
  }
  return local_->count > before;
}

bool LocalStep::may_leave_out() const noexcept { return candidates_->count >= kManyPairs && !bodies_->setup().bends; }

// A contact joins in the first round if it pressed in the last solution or if the motion to p̂ passes it. Other
// contacts join when a solution passes them.
bool LocalStep::solve(const ToolPose& pose, const Twist& e, const ToolPose& q_old, double rough, double still_m,
                      Twist& delta) noexcept {
  Twist e_coupled = couple(pose, e);
  bodies_->measure_slip(pose, q_old);
  local_->count = 0;
  local_->kept = false;
  bool solved = true;
  delta = -e;
  for (int round = 0; round < kRounds; ++round) {
    if (touches_->within_m < Touches::everywhere_m && bodies_->size_m(delta) > touches_->within_m) {
      find(pose);
      local_->count = 0;
      delta = -e;
      round = 0;
    }
    if (!join(pose, q_old, delta, round == 0, still_m)) break;
    local_->kept = round == 0 && still_m > 0.0 && still_holds(pose, e_coupled, still_m, delta);
    if (local_->kept) continue;
    solved = local_->problem.solve(e_coupled, contacts(), delta, rough);
    if (solved) continue;
    attempt_->poses_left -= kHard;
    solved = solve_unbent(e, rough, e_coupled, delta) || solve_fewer(pose, e_coupled, rough, delta);
  }
  move_touches(pose, delta);
  keep_forces();
  return solved;
}

// Sets the stiffness of the local problem to the coupling plus the bends of the gaps that pressed, and returns ẽ
// (bends.hpp).
Twist LocalStep::couple(const ToolPose& pose, const Twist& e) noexcept {
  if (!bodies_->setup().bends && !bodies_->setup().edges_bend) return e;
  Mat6 K = local_->K;
  bool bent = false;
  local_->lies_along = false;
  for (const Found& found : touches_->all()) {
    const PressedPlaces::Place* last = candidates_->pressed.of(found.pair, found.which);
    if (last == nullptr) continue;
    const double f_n = found.touch.normal.dot(last->force_W);
    if (!(f_n > 0.0) || !add_bend(*bodies_, pair_of(found), found, pose, f_n, K)) continue;
    bent = true;
    local_->lies_along = local_->lies_along || is_along_side(pair_of(found).kind);
  }
  attempt_->bends = attempt_->bends || bent;
  local_->problem.set_stiffness(K);
  return bent ? local_->problem.yield_to(local_->K * e) : e;
}

// Moves the touches by δ, so that the places of the solution are reported instead of the places of the linearisation.
void LocalStep::move_touches(const ToolPose& pose, const Twist& delta) noexcept {
  for (std::size_t k = 0; k < local_->count; ++k) {
    Found& found = touches_->found[local_->touch_of[k]];
    const Vec3 lever = found.touch.point - pose.position;
    Vec3 along = Vec3::Zero();
    if (is_along_side(pair_of(found).kind) && presses(k)) {
      if (const auto sides = near_sides(*bodies_, pair_of(found), found.touch, pose)) along = sides->way(delta);
    }
    found.touch.gap = gap_after(found, pose, delta);
    found.touch.point += delta.head<3>() + delta.tail<3>().cross(lever) + along;
  }
}

// Whether the forces of the last solution still hold the tool at this pose, to within rounding. Reason: if more
// contacts hold the tool than are needed, many sets of forces are possible, and by friction each set belongs to a
// slightly different pose. A new solution would choose another set each time, depending on the rounding of the gaps,
// and the tool would never come to rest.
bool LocalStep::still_holds(const ToolPose& pose, const Twist& e, double still_m, Twist& delta) noexcept {
  const Twist before = delta;
  bool still = local_->problem.holds(e, contacts(), delta);
  for (std::size_t k = 0; still && k < local_->count; ++k) {
    const double gap = gap_after(found_of(k), pose, delta);
    still = gap >= -still_m && (!presses(k) || gap <= still_m);
  }
  if (!local_->lies_along) still = still && bodies_->size_m(delta) <= kStill_m;
  if (!still) delta = before;
  return still;
}

// Solves the local problem without bends. If sides lie along each other, the stiffness with bends has a condition
// number of 1e10, and rounding may prevent a solution. Without bends the iteration converges more slowly.
bool LocalStep::solve_unbent(const Twist& e, double rough, Twist& e_coupled, Twist& delta) noexcept {
  if (!local_->lies_along || --attempt_->retries_left < 0) return false;
  local_->problem.set_stiffness(local_->K);
  local_->problem.allow(kWork);
  e_coupled = e;
  return local_->problem.solve(e, contacts(), delta, rough);
}

// Solves the local problem without the contacts that have hardly any force. If an edge of the tool lies on a vertex of
// a mesh, all the vertex's edges hold the tool at one place, most of them with almost no force. Rounding then decides
// which contacts press, and no solution may be found. Returns false if no solution is found, or if the solution passes
// a contact that was left out by more than half of kGap_m.
bool LocalStep::solve_fewer(const ToolPose& pose, const Twist& e, double rough, Twist& delta) noexcept {
  double most = 0.0;
  for (const LinearContact& contact : contacts()) most = std::max(most, contact.f[0]);
  std::size_t bearing = 0;
  for (std::size_t k = 0; k < local_->count; ++k) {
    if (!(local_->contacts[k].f[0] > kIdle * most)) continue;
    std::swap(local_->contacts[k], local_->contacts[bearing]);
    std::swap(local_->axes[k], local_->axes[bearing]);
    std::swap(local_->touch_of[k], local_->touch_of[bearing]);
    ++bearing;
  }
  if (bearing == 0 || bearing == local_->count || --attempt_->retries_left < 0) return false;
  local_->problem.allow(kWork);
  if (!local_->problem.solve(e, contacts().first(bearing), delta, rough)) return false;
  for (std::size_t k = bearing; k < local_->count; ++k) {
    local_->contacts[k].f.setZero();
    local_->contacts[k].state = ContactState::open;
    if (gap_after(found_of(k), pose, delta) < -0.5 * kGap_m) return false;
  }
  return true;
}

void LocalStep::keep_forces() noexcept {
  for (Pair& pair : candidates_->all()) pair.pressed = false;
  PressedPlaces& pressed = candidates_->pressed;
  pressed.count = 0;
  for (std::size_t k = 0; k < local_->count; ++k) {
    if (!presses(k)) continue;
    const Found& found = found_of(k);
    Pair& pair = candidates_->pairs[found.pair];
    pair.pressed = true;
    const Vec3 force = local_->axes[k] * local_->contacts[k].f;
    if (found.which == 0) pair.force_W = force;
    pressed.places[pressed.count++] = {found.pair, found.which, force, found.touch.point};
  }
}

void LocalStep::drop_contacts() noexcept {
  local_->count = touches_->count = 0;
  keep_forces();
}

bool LocalStep::on_features() const noexcept {
  if (attempt_->feet.beside > beside_m) return false;
  for (std::size_t k = 0; k < local_->count; ++k) {
    if (presses(k) && found_of(k).over) return false;
  }
  return true;
}

bool LocalStep::bar_what_reaches_beyond(const ToolPose& pose) noexcept {
  const View at = view(pose);
  bool some = false;
  for (std::size_t k = 0; k < local_->count; ++k) {
    const Found& found = found_of(k);
    if (!presses(k) || !reaches_beyond(*bodies_, pair_of(found), found.touch, at)) continue;
    candidates_->pairs[found.pair].barred = some = true;
  }
  return some;
}

// Rotations aren't vectors: log(exp δ exp e) = δ + e + δ × e/2 to second order. The last term is the error of the
// balance.
bool LocalStep::stays_balanced(const Twist& delta, const Twist& e) const noexcept {
  Twist bent = Twist::Zero();
  bent.tail<3>() = 0.5 * Vec3(delta.tail<3>()).cross(Vec3(e.tail<3>()));
  return (local_->K * bent).squaredNorm() <= kBalance * kBalance * (local_->K * (e + delta)).squaredNorm();
}

// A normal turns if the tool turns, for faces and edges of the tool; the normal of a round body also turns if the place
// of contact moves. The normals of the object's faces don't turn. Hollow objects are left out, because the iteration
// has a stricter condition with bends.
double LocalStep::normals_turn_by(const Twist& delta) const noexcept {
  double bend = 0.0;
  bool turns = false;
  for (std::size_t k = 0; k < local_->count; ++k) {
    if (!presses(k)) continue;
    const Pair& pair = pair_of(found_of(k));
    if (pair.kind == PairKind::point_face || is_in_field(pair.kind)) {
      continue;
    }
    turns = true;
    bend = std::max(bend, curvature_per_m(*bodies_, pair));
  }
  if (!turns) return 0.0;
  const double turned = delta.tail<3>().norm();
  return turned + bend * (delta.head<3>().norm() + bodies_->setup().reach_m * turned);
}

// 1. If contacts press against each other, the local problem is solved only to 1e-10 of the wrench K e.
// 2. The part of a force that is outside of its cone is removed. δ is corrected such that the wrenches balance again:
//    an error of 1e-9 N moves the tool by 1e-16 m on a coupling of 10 N/µm.
// 3. A coupling of 10 N/mm that presses by centimetres would yield by picometres. A correction of more than half of
//    kGap_m is left out.
// 4. With bends the stiffness isn't K, and the local problem is solved more accurately, so there is no correction.
void LocalStep::balance(const Twist& e, Twist& delta) noexcept {
  if (attempt_->bends) return;
  const Twist wrench = local_->K * (e + delta);
  Twist lack = -wrench;
  for (LinearContact& contact : contacts()) {
    if (contact.state == ContactState::open) continue;
    contact.f = in_cone(contact.f, contact.mu);
    lack.noalias() += contact.J.transpose() * contact.f;
  }
  if (!(lack.squaredNorm() > kBalance * kBalance * wrench.squaredNorm())) return;
  const Twist way = local_->problem.yield_to(lack);
  if (bodies_->size_m(way) <= 0.5 * kGap_m) delta += way;
}

}  // namespace proxarm::models
