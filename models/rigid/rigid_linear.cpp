// The local problem at a pose: which contacts join it, its solution, and whether that is good enough to end on.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// What a local problem that has no solution, or none that is found, costs, in poses.
constexpr int kHard = 40;
// What bears less than this share of the greatest force, and what bends, may be left out where nothing else helps, so
// often in a step.
constexpr double kIdle = 1e-3;
// Contacts that are passed by less than rounding don't join. Where more than a few are, so many at a time do; and none
// that is passed by less than a hundredth of what a gap may be short of need be known.
constexpr double kPassed_m = 1e-16, kPassedAmongMany_m = 1e-14;
constexpr std::size_t kAtATime = 5, kFewPassed = 12;
constexpr int kRounds = 16;
// Of so many pairs it pays to know which are far.
constexpr std::size_t kManyPairs = 12;
// What the wrench may lack after the last step of the iteration: of 10 N, a third of 1e-10 N.
constexpr double kBalance = 3e-12;

}  // namespace

void RigidWorld::linearise(const Found& found, const ToolPose& pose, const ToolPose& q_old, LinearContact& out,
                           Mat3& axes) const noexcept {
  const Pair& pair = pairs_[found.pair];
  const Vec3& n = found.touch.normal;
  axes.col(0) = n;
  axes.col(1) = n.unitOrthogonal();
  axes.col(2) = n.cross(axes.col(1));
  const Vec3 lever = found.touch.point - pose.position;
  for (int k = 0; k < 3; ++k) {
    out.J.row(k).head<3>() = axes.col(k);
    out.J.row(k).tail<3>() = lever.cross(axes.col(k));
  }
  // From where the tool's material point was.
  const Vec3 slip = slip_since(q_old, pair.entry, found.touch.point, pose);
  out.c << found.touch.gap, axes.col(1).dot(slip), axes.col(2).dot(slip);
  out.mu = without_friction_ ? 0.0 : friction(pair);
  const Pressed* last = found.which == 0 ? nullptr : last_pressed(found.pair, found.which);
  const Vec3* force = last != nullptr ? &last->force_W : found.which == 0 && pair.pressed ? &pair.force_W : nullptr;
  out.f = force != nullptr ? Vec3(axes.transpose() * *force) : Vec3(Vec3::Zero());
}

// A pair's linearised gap after a twist.
double RigidWorld::approach(const Found& found, const ToolPose& pose, const Twist& xi) noexcept {
  const Vec3 lever = found.touch.point - pose.position;
  return found.touch.gap + found.touch.normal.dot(xi.head<3>() + xi.tail<3>().cross(lever));
}

// A face that comes down on a fine mesh passes many of its vertices at once, as a prism of many sides does that stands
// up on a table, and few of them will hold it: those that it passes by most join first, four at a time. Below how much
// they are passed; where few are, by anything.
double RigidWorld::worst_passed(const Twist& xi, const ToolPose& pose) const noexcept {
  std::array<double, kAtATime> least;
  least.fill(-kPassed_m);
  std::size_t passed = 0;
  for (std::size_t i = 0; i < found_count_; ++i) {
    if (found_[i].working) continue;
    double gap = approach(found_[i], pose, xi);
    if (!(gap < -kPassed_m)) continue;
    ++passed;
    for (double& other : least) {
      if (gap < other) std::swap(gap, other);
    }
  }
  if (!shared_->dense && passed <= kFewPassed) return -kPassed_m;
  // (many may be passed by as much to the bit)
  return least.front() == least.back() ? std::nextafter(least.back(), 0.0) : least.back();
}

// Those that δ passes, and of the first ones what pressed last time. False: there are none that aren't in yet.
bool RigidWorld::join(const ToolPose& pose, const ToolPose& q_old, const Twist& delta, bool first,
                      double still_m) noexcept {
  const double worst = worst_passed(delta, pose);
  const bool some = worst < -kPassed_m;  // of those that are passed
  std::size_t joined = 0;
  const std::size_t before = linear_count_;
  for (std::size_t i = 0; i < found_count_; ++i) {
    Found& found = found_[i];
    if (found.working) continue;
    const bool pressed = pairs_[found.pair].pressed;
    const double gap = approach(found, pose, delta);
    const bool passed = gap < worst && (!some || joined + 1 < kAtATime);
    if (!passed && !(first && pressed)) continue;
    if (linear_count_ == ContactProblem::most) {
      overflow_ = overflow_ || gap < -kPassedAmongMany_m;
      continue;
    }
    if (passed) ++joined;
    found.working = true;
    of_linear_[linear_count_] = static_cast<std::uint16_t>(i);
    LinearContact& linear = linear_[linear_count_];
    linearise(found, pose, q_old, linear, axes_[linear_count_]);
    // What pressed is still there; forces that hold each other would follow rounding.
    if (pressed && lies_along_ && std::abs(linear.c[0]) <= still_m) linear.c[0] = 0.0;
    ++linear_count_;
  }
  return linear_count_ > before;
}

// Whether pairs that are far may be left out. Where gaps bend the coupling yields as the pairs that pressed have it.
bool RigidWorld::may_leave_out() const noexcept { return pair_count_ >= kManyPairs && !shared_->bends; }

// Solves the local problem at a pose that is by e off p̂. Contacts that neither pressed last time nor are passed on the
// way to p̂ join when a solution passes them. `still_m`: rounding, where the last solution may hold already; or 0.
bool RigidWorld::solve_linear(const ToolPose& pose, const Twist& e, const ToolPose& q_old, double rough, double still_m,
                              Twist& delta) noexcept {
  Twist e_coupled = couple(pose, e);
  see_slip(pose, q_old);
  linear_count_ = 0;
  held_ = false;
  bool solved = true;
  delta = -e;
  for (int round = 0; round < kRounds; ++round) {
    if (within_m_ < kEverywhere_m && size_m(delta) > within_m_) {
      find(pose);
      linear_count_ = 0;
      delta = -e;
      round = 0;
    }
    if (!join(pose, q_old, delta, round == 0, still_m)) break;
    held_ = round == 0 && still_m > 0.0 && still_holds(pose, e_coupled, still_m, delta);
    if (held_) continue;
    solved = problem_.solve(e_coupled, {linear_.data(), linear_count_}, delta, rough);
    if (solved) continue;
    budget_ -= kHard;
    solved = solve_unbent(e, rough, e_coupled, delta) || solve_fewer(pose, e_coupled, rough, delta);
  }
  // What is reported is where the contact goes with this solution, not where it was linearised.
  for (std::size_t k = 0; k < linear_count_; ++k) {
    Found& found = found_[of_linear_[k]];
    const Vec3 lever = found.touch.point - pose.position;
    const bool goes_along = is_along_side(pairs_[found.pair].kind) && linear_[k].state != ContactState::open;
    const Vec3 along = goes_along ? way_along_side(found, pose, delta) : Vec3(Vec3::Zero());
    found.touch.gap = approach(found, pose, delta);
    found.touch.point += delta.head<3>() + delta.tail<3>().cross(lever) + along;
  }
  keep_forces();
  return solved;
}

// Whether the forces of the last solution hold the tool here, to within rounding. Where more contacts hold it than are
// needed, forces are many that do, and friction makes a pose of each: a local problem that is solved anew comes to
// others each time, as rounding of the gaps has it, and nothing ever comes to rest.
bool RigidWorld::still_holds(const ToolPose& pose, const Twist& e, double still_m, Twist& delta) noexcept {
  const Twist before = delta;
  bool still = problem_.holds(e, {linear_.data(), linear_count_}, delta);
  for (std::size_t k = 0; still && k < linear_count_; ++k) {
    const double gap = approach(found_[of_linear_[k]], pose, delta);
    still = gap >= -still_m && (linear_[k].state == ContactState::open || gap <= still_m);
  }
  if (!lies_along_) still = still && size_m(delta) <= kStill_m;
  if (!still) delta = before;
  return still;
}

// Where sides lie along each other, what bends has a condition of 1e10, and no forces are found that hold to within
// rounding. Without the bends the iteration goes on, if more slowly.
bool RigidWorld::solve_unbent(const Twist& e, double rough, Twist& e_coupled, Twist& delta) noexcept {
  if (!lies_along_ || --fewer_ < 0) return false;
  problem_.set_stiffness(K_);
  problem_.allow(kWork);
  e_coupled = e;
  return problem_.solve(e, {linear_.data(), linear_count_}, delta, rough);
}

// Where an edge of the tool lies on a vertex of a mesh, all edges there hold it at one place, most of them with next to
// nothing, and rounding decides which: no forces are found. Without those the others hold it alone, if then nothing is
// passed by more than half of what a gap may be short of.
bool RigidWorld::solve_fewer(const ToolPose& pose, const Twist& e, double rough, Twist& delta) noexcept {
  double most = 0.0;
  for (std::size_t k = 0; k < linear_count_; ++k) most = std::max(most, linear_[k].f[0]);
  std::size_t bearing = 0;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    if (!(linear_[k].f[0] > kIdle * most)) continue;
    std::swap(linear_[k], linear_[bearing]);
    std::swap(axes_[k], axes_[bearing]);
    std::swap(of_linear_[k], of_linear_[bearing]);
    ++bearing;
  }
  if (bearing == 0 || bearing == linear_count_ || --fewer_ < 0) return false;
  problem_.allow(kWork);
  if (!problem_.solve(e, {linear_.data(), bearing}, delta, rough)) return false;
  for (std::size_t k = bearing; k < linear_count_; ++k) {
    linear_[k].f.setZero();
    linear_[k].state = ContactState::open;
    if (approach(found_[of_linear_[k]], pose, delta) < -0.5 * kGap_m) return false;
  }
  return true;
}

void RigidWorld::keep_forces() noexcept {
  for (std::size_t i = 0; i < pair_count_; ++i) pairs_[i].pressed = false;
  pressed_count_ = 0;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    if (linear_[k].state == ContactState::open) continue;
    const Found& found = found_[of_linear_[k]];
    Pair& pair = pairs_[found.pair];
    pair.pressed = true;
    const Vec3 force = axes_[k] * linear_[k].f;
    if (found.which == 0) pair.force_W = force;
    pressed_[pressed_count_++] = {found.pair, found.which, force, found.touch.point};
  }
}

// Whether all that presses lies on what it is pressed to, to within rounding.
bool RigidWorld::on_features() const noexcept {
  if (beside_ > beside_m) return false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    if (linear_[k].state != ContactState::open && found_[of_linear_[k]].over) return false;
  }
  return true;
}

// Whether the wrench is balanced after δ from a pose that is by e off p̂ as the local problem has it. Rotations aren't
// vectors: log(exp δ exp e) = δ + e + δ × e/2 to second order.
bool RigidWorld::stays_balanced(const Twist& delta, const Twist& e) const noexcept {
  Twist bent = Twist::Zero();
  bent.tail<3>() = 0.5 * Vec3(delta.tail<3>()).cross(Vec3(e.tail<3>()));
  return (K_ * bent).squaredNorm() <= kBalance * kBalance * (K_ * (e + delta)).squaredNorm();
}

// By how much a twist turns the normals of what presses at most, rad: those of the tool's faces and of edges as the
// tool turns, and of what is round as it goes on. (Of hollow objects settle() asks for more.)
double RigidWorld::normals_turn_by(const Twist& delta) const noexcept {
  double bend = 0.0;
  bool turns = false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    if (linear_[k].state == ContactState::open) continue;
    const Pair& pair = pairs_[found_[of_linear_[k]].pair];
    if (pair.kind == Kind::point_face || pair.kind == Kind::point_field || pair.kind == Kind::rim_field) continue;
    turns = true;
    bend = std::max(bend, bend_per_m(pair));
  }
  if (!turns) return 0.0;
  const double turned = delta.tail<3>().norm();
  return turned + bend * (delta.head<3>().norm() + shared_->reach * turned);
}

Vec3 RigidWorld::in_cone(Vec3 f, double mu) noexcept {
  f[0] = std::max(f[0], 0.0);
  const double size = f.tail<2>().norm(), limit = mu * f[0];
  if (size > limit) f.tail<2>() *= limit / size;
  return f;
}

// The local problem is solved to 1e-10 of the free motion's press where contacts hold each other. What forces are then
// out of their cones by is taken off, and the tool moves by what wrenches lack to balance: 1e-9 N is 1e-16 m on a
// coupling of 10 N/µm. A coupling of 10 N/mm that presses by centimetres yields to 1e-10 of that by picometres: what
// would use up half of what a gap may be short of is left to lack. Where gaps bend, the coupling isn't K, and the law
// is met more closely.
void RigidWorld::balance(const Twist& e, Twist& delta) noexcept {
  if (bends_) return;
  const Twist wrench = K_ * (e + delta);
  Twist lack = -wrench;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    LinearContact& contact = linear_[k];
    if (contact.state == ContactState::open) continue;
    contact.f = in_cone(contact.f, contact.mu);
    lack.noalias() += contact.J.transpose() * contact.f;
  }
  if (!(lack.squaredNorm() > kBalance * kBalance * wrench.squaredNorm())) return;
  const Twist way = problem_.yield_to(lack);
  if (size_m(way) <= 0.5 * kGap_m) delta += way;
}

}  // namespace proxarm::models
