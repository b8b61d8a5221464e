#include "models/rigid/rigid_world.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "models/rigid_features/mesh_part.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_shapes/two_cylinders.hpp"

namespace proxarm::models {
namespace {

// A part of a step moves no point of the tool by more than this share of the least thickness of what may meet; features
// that were up to twice as far behind another one may come to lie before it, as where an edge leaves the end of one
// edge for the next, but never those of a far side.
constexpr double kPart = 0.2;
// A step may take so many poses; a local problem that has no solution, or none that is found, costs a hundred times
// what one at hand does. What is left then counts as unresolved: the tool goes as far as the parts of the step got.
constexpr int kBudget = 400, kHard = 40, kBudgetOfPart = 50;
// Beside that, so many contacts may be looked at in local problems, and so many more for each part of the step: some
// 0.2 µs each. Without it local problems that have no solution took up to 13 ms of a cycle.
constexpr int kWork = 1200, kWorkOfPart = 60;
// Twice that in a step of several parts, and once more for the last of them, whose forces are asked for.
constexpr int kWorkOfFar = 2400;
// A part that finds no forces may be left out where the next one finds some, but not two in a row: sides reach as far
// as two parts do.
constexpr int kMostLeftOut = 1;
// What bears less than this share of the greatest force, and what bends, may be left out where nothing else helps, so
// often in a step.
constexpr double kIdle = 1e-3;
constexpr int kFewer = 6;
// Contacts that are passed by less than rounding don't join. Where more than a few are, so many at a time do; and none
// that is passed by less than a hundredth of what a gap may be short of need be known.
constexpr double kPassed_m = 1e-16, kPassedAmongMany_m = 1e-14;
constexpr std::size_t kAtATime = 5, kFewPassed = 12;
constexpr int kRounds = 16;
constexpr int kWorkInside = 600;  // of hollow objects, where a look costs 0.5 µs and most steps take thirty
// Newton's iteration with the gaps' curvature: what comes before a step of this size needn't be exact. A local problem
// that is solved to this share of the last step leads as near.
constexpr double kRoughShare = 1e-5;
constexpr double kNear_m = 1e-9;
// And the last step turns normals by no more than 1e-10 of a clearance of ten micrometres.
constexpr double kStill_m = 1e-15;
// What is further away than so many times the way to p̂ isn't looked at: a stiff coupling seldom yields by more than
// that way, to either side. Where it does, all is looked at.
constexpr double kWithin = 2.0;
// Of so many pairs it pays to know which are far.
constexpr std::size_t kManyPairs = 12;
// By how much normals may still turn in the last step, whose forces are those of normals before it: of 10 N that is a
// tenth of a nanonewton across.
constexpr double kTurned = 1e-11;
// A tool that rests among more contacts than hold it may have a solution at one pose and, for rounding, none at the
// next, or steps that don't get smaller than rounding of its forces makes them. After a step below this the first one
// is taken: normals are right to 1e-8 then.
constexpr double kRest_m = 1e-13;
// From the fourth pose on only a share of a step is taken, halved as long as steps don't become smaller: from far it
// may swing to and fro.
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
// What the wrench may lack after the last step of the iteration: of 10 N, a third of 1e-10 N.
constexpr double kBalance = 3e-12;
// Rounding of the work of 1000 N over a millimetre is ten thousand times less.
constexpr double kNothing_J = 1e-12;

// More pairs of corners than a box has among twenty others: where most of them came near, a step would look at too
// much.
constexpr std::size_t kManyCorners = 1280;

// The least extent of a solid; features on its far side are that far away.
double thickness(const Solid& solid) {
  double least = std::numeric_limits<double>::infinity();
  if (solid.radius > 0.0) return solid.radius;
  for (const Solid::Face& face : solid.faces) {
    double low = face.offset;
    for (const Vec3& p : solid.points) low = std::min(low, face.normal.dot(p));
    least = std::min(least, face.offset - low);
  }
  if (solid.rims.size() == 2) {
    least = std::min(2.0 * solid.rims[0].radius, (solid.rims[0].centre - solid.rims[1].centre).norm());
  }
  return least;
}

Bounds bounds_of(const Solid& solid, double around) {
  Bounds bounds;
  for (int k = 0; k < 3; ++k) {
    bounds.low[k] = -extent_along(solid, -Vec3::Unit(k)) + solid.radius - around;
    bounds.high[k] = extent_along(solid, Vec3::Unit(k)) - solid.radius + around;
  }
  return bounds;
}

std::optional<Cylinder> cylinder_in(const Solid& solid) {
  if (solid.rims.size() != 2) return {};
  return cylinder_of(solid);
}

// What no contact is known for.
void require_contact(bool cylinder, const RigidObject& object) {
  if (!cylinder) return;
  const auto* tube = std::get_if<HollowTube>(&object.shape);
  if (tube != nullptr && !tube->endless) {
    throw std::invalid_argument("a cylinder as a tool isn't held by the round ends of a tube");
  }
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  if (mesh != nullptr && !(*mesh)->mesh().closed()) {
    throw std::invalid_argument("a cylinder as a tool isn't held by an open mesh");
  }
}

MeshPart part_of(const ToolPart& part) {
  if (const auto* mesh = std::get_if<MeshTool>(&part.shape)) return mesh_part(*mesh, part.X_TP);
  MeshPart out;
  std::visit(
      [&](const auto& shape) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, MeshTool>) out.solid = solid_of(shape, part.X_TP);
      },
      part.shape);
  out.thickness_m = thickness(out.solid);
  return out;
}

Bounds bounds_of(const RigidObject& object) {
  if (const Solid* solid = std::get_if<Solid>(&object.shape)) return bounds_of(*solid, solid->radius);
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape)) {
    return (*mesh)->mesh().bounds();
  }
  return {};
}

}  // namespace

RigidWorld::RigidWorld(const Tool& tool, std::vector<RigidObject> objects) {
  auto shared = std::make_shared<Shared>();
  shared->thinness = std::numeric_limits<double>::infinity();
  for (const ToolPart& part : tool.parts) {
    auto [mesh, solid, thick] = part_of(part);
    if (part.friction && !(*part.friction >= 0.0 && std::isfinite(*part.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    if (!mesh && solid.edges.size() > most_edges) throw std::invalid_argument("a hull of more than 2000 points");
    shared->thinness = std::min(shared->thinness, thick);
    shared->dense = shared->dense || mesh;
    shared->reach = std::max(shared->reach, solid.reach);
    shared->bends = shared->bends || !solid.rims.empty();
    const Bounds box = bounds_of(solid, 0.0);
    const std::optional<Cylinder> cylinder = cylinder_in(solid);
    shared->parts.push_back({std::move(solid), box, part.friction, std::move(mesh), cylinder});
  }
  if (tool.parts.empty()) {
    Solid point;
    point.points = {Vec3::Zero()};
    const Bounds box = bounds_of(point, 0.0);
    shared->parts.push_back({std::move(point), box, {}});
  }
  std::vector<RigidObject> still_first;
  for (RigidObject& object : objects) {
    if (!object.motion) still_first.push_back(std::move(object));
  }
  shared->first_moving = still_first.size();
  for (RigidObject& object : objects) {
    if (object.motion) still_first.push_back(std::move(object));
  }
  std::size_t corners = 0, own_corners = 0;
  for (RigidObject& object : still_first) {
    if (!(object.friction >= 0.0 && std::isfinite(object.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    for (const Part& part : shared->parts) require_contact(part.cylinder.has_value(), object);
    std::optional<Cylinder> cylinder;
    if (const Solid* solid = std::get_if<Solid>(&object.shape)) {
      shared->thinness = std::min(shared->thinness, thickness(*solid));
      cylinder = cylinder_in(*solid);
      shared->bends = shared->bends || cylinder;
    }
    shared->hollow = shared->hollow || std::holds_alternative<HollowSphere>(object.shape) ||
                     std::holds_alternative<HollowTube>(object.shape);
    shared->bends = shared->bends || shared->hollow;
    const Bounds bounds = bounds_of(object);
    double held = 0.0;
    if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape)) {
      shared->dense = true;
      held = (object.inside_out ? -1.0 : 1.0) * (*mesh)->outwards();
    }
    corners += std::holds_alternative<Solid>(object.shape) ? std::get_if<Solid>(&object.shape)->points.size() : 0;
    friction_.push_back(object.friction);
    if (object.motion) {
      const Vec3 middle = bounds.finite() ? Vec3(0.5 * (bounds.low + bounds.high)) : Vec3(Vec3::Zero());
      moving_.push_back({object.motion->driven ? RigidMover(middle) : RigidMover(object.motion->script)});
    }
    const Solid* solid = std::get_if<Solid>(&object.shape);
    const Bounds box = solid != nullptr ? bounds_of(*solid, 0.0) : bounds;
    shared->entries.push_back({std::move(object), bounds, box, held, cylinder});
  }
  for (const Part& part : shared->parts) own_corners += part.solid.points.size();
  shared->dense = shared->dense || corners * own_corners > kManyCorners;
  // Where gaps bend, most of the iteration is rough, and a peg that goes by the closed form ends more often in a jam
  // that has no solution: in 17 of 8,000 steps where it was none.
  problem_.use_closed_form(!shared->bends);
  const auto is_mesh = [](const Entry& e) {
    return std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(e.object.shape);
  };
  const bool of_tool = std::any_of(shared->parts.begin(), shared->parts.end(), [](const Part& p) { return p.mesh; });
  if (of_tool && std::any_of(shared->entries.begin(), shared->entries.end(), is_mesh)) {
    near_leaves_.make_room(most_leaves, shared->parts.size() * shared->first_moving);
    for (Part& part : shared->parts) {
      if (part.mesh) part.discs = NodeDiscs(flat_mesh(part).mesh);
    }
    for (Entry& e : shared->entries) {
      if (is_mesh(e)) e.discs = NodeDiscs(flat_mesh(e).mesh);
    }
  }
  shared_ = std::move(shared);
}

double RigidWorld::motion(const ToolPose& a, const ToolPose& b) const noexcept {
  return a == b ? 0.0 : size_m(difference(a, b));
}

double RigidWorld::size_m(const Twist& xi) const noexcept {
  return xi.head<3>().norm() + shared_->reach * xi.tail<3>().norm();
}

double RigidWorld::friction(const Pair& pair) const noexcept {
  const double mu = friction_[pair.entry];
  const std::optional<double>& own = shared_->parts[pair.part].friction;
  return own ? std::sqrt(*own * mu) : mu;
}

void RigidWorld::set_friction(std::int32_t object, double friction) noexcept {
  for (std::size_t i = 0; i < friction_.size(); ++i) {
    if (shared_->entries[i].object.object == object) friction_[i] = friction;
  }
}

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
  if (shared_->bends) return;
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

// The share of a step that is taken, from that of the step before and the sizes of both.
double RigidWorld::damped(double share, double size, double last) noexcept {
  if (size <= kNoise_m) return 1.0;
  const bool shrinks = size < (1.0 - 0.4 * share) * last;
  return shrinks ? std::min(2.0 * share, 1.0) : std::max(0.5 * share, kLeastShare);
}

// Of gaps.
double RigidWorld::rounding_m(const ToolPose& pose) const noexcept {
  return 4.0 * std::numeric_limits<double>::epsilon() * (pose.position.lpNorm<1>() + shared_->reach + extent_m_);
}

// From a pose on, until nothing moves.
bool RigidWorld::settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept {
  const double rounding = rounding_m(q);
  double last = std::numeric_limits<double>::infinity(), share = 1.0, rest = kRest_m;
  ToolPose resting;
  collected_ = false;
  for (int k = 0; k < 50; ++k) {
    if (--budget_ < 0 || looks_ < 0 || problem_.exhausted()) break;
    beside_ = k < kToAndFro ? beside_m : std::clamp(last, beside_m, kBesideAtMost_m);
    over_m_ = std::isfinite(last) ? std::clamp(last, beside_m, kBesideAtMost_m) : beside_m;
    const Twist e = difference(q, p_hat);
    find(q, may_leave_out() ? kWithin * size_m(e) : kEverywhere_m);
    Twist delta;
    const bool roughly = shared_->bends && k > 0 && last > kNear_m;
    const double rough = roughly ? kRoughShare * std::min(last / motion(q, p_hat), 1.0) : 0.0;
    const double still_m = shared_->bends && !roughly && last < kNear_m ? rounding : 0.0;
    const bool solved = solve_linear(q, e, q_old, rough, still_m, delta);
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
    if (shared_->bends && k >= 3) share = damped(share, size, last);
    q = moved(q, share * delta);
    // What is left after this is the last ratio times this. Where gaps bend, this step counts as well: the forces are
    // those of normals before it.
    const bool on = on_features();
    const bool whole = share == 1.0 && !roughly && on && (!shared_->bends || size <= kStill_m);
    const bool small = std::isfinite(last) && size < 0.1 * last && size / last * size <= 0.1 * rounding &&
                       stays_balanced(delta, e) && normals_turn_by(delta) <= kTurned;
    if (whole && ((held_ && size <= kStill_m) || size <= rounding || small)) {
      collected_ = false;
      return solved;
    }
    if (solved && !roughly && on && size < rest) {
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
  const bool comes = something_comes();
  if (comes && parts > 1) return in_strides(p_hat, q_old, far, parts, q);
  int left_out = 0;  // the parts just before this one
  ToolPose reached = q_old;
  overflow_ = squeezed_ = false;
  let_go(0.0);
  set_sides(q_old, far / parts);
  for (int k = 1; k <= parts; ++k) {
    if (crowded_) {  // what isn't known may be in the way
      q = reached;
      return false;
    }
    const double share = static_cast<double>(k) / parts;
    reached = let_go_with(reached, share);
    const ToolPose p = k == parts ? p_hat : on_the_way(p_hat, q_old, share);
    if (comes || (k == parts && parts > 1)) share_out(k == parts);
    ToolPose next = reached;
    if (settle(p, q_old, next)) {
      left_out = 0;
      reached = next;
    } else {
      // Only the last part's forces are asked for. Before it, any pose will do that leads through nothing.
      const bool may = comes || (k < parts && left_out++ < kMostLeftOut);
      const bool on = may && (overflow_ = false, give_way(reached)) && k < parts;
      if (!on) {
        q = reached;
        return false;
      }
    }
    if (k < parts) {
      if (came_m(reached) > 0.5 * gathered_reach_) gather(reached, gathered_reach_);
      set_sides(reached, far / parts);
    }
  }
  q = reached;
  return true;
}

// The tool begins anew, elsewhere: nothing is known about where it is.
void RigidWorld::forget() noexcept {
  pair_count_ = pressed_count_ = 0;
  gathered_reach_ = -1.0;
  near_leaves_.forget();
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
  budget_ = kBudget + 8 * parts;
  looks_ = kLooks;
  fewer_ = kFewer;
  allow_for(parts);
  // (far shrinks with the goal only where nothing moves)
  const double to_goal = moving_.empty() && !whole ? motion(goal, q) : far;
  bool fine = in_parts(goal, q, to_goal, parts, q_) && !went_in(q), looked = true;
  // What has used up what it may look at finds no more in smaller parts, nor without friction.
  const auto may = [&] { return looks_ > 0 || !something_comes(); };
  if (fine && gives_energy(q)) {
    if (may()) looked = look_again(goal, q, to_goal, parts);
  } else if (!fine && budget_ > 0 && finer(parts) > 1 && may()) {
    fine = in_smaller_parts(goal, q, to_goal, parts, q_) && !went_in(q);
  }
  // Where no forces are found that keep all laws, friction is left out of this step. A tool that stayed where it is
  // would meet the same problem in the next one. In a hole it stays nevertheless, where a part of the step last kept
  // the law: there a jam is what most often has no solution, and without friction it would slip right through.
  const bool lawful = fine && looked;
  if (!fine && !shared_->hollow && may()) {
    budget_ = kBudget;
    looks_ = something_comes() ? std::min(looks_, kLooks / 2) : kLooks / 2;
    problem_.allow(kWork);
    without_friction_ = true;
    const ToolPose reached = q_;
    // The iteration may have gone by far in a part: in the dent of a mesh past a face that holds only over itself.
    fine = in_parts(goal, q, to_goal, parts, q_) && !(shared_->dense && stands_in(q_));
    without_friction_ = false;
    if (!fine) q_ = reached;
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
  return something_comes() ? std::clamp(kMostParts / 2 / parts, 1, 8) : 8;
}

bool RigidWorld::in_smaller_parts(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts,
                                  ToolPose& q) noexcept {
  parts *= finer(parts);
  allow_for(parts);
  let_go(0.0);
  gather(q_old, gathered_reach_);
  return in_parts(p_hat, q_old, far, parts, q);
}

// In smaller parts; if they lead nowhere or into a mesh, what was found stays. False: nothing is left to look at what
// may be far from lawful, and the tool stays where they led.
bool RigidWorld::look_again(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts) noexcept {
  if (finer(parts) == 1) return true;
  const ToolPose found = q_;
  const std::array<PoseContact, ContactProblem::most> contacts = contacts_;
  const std::array<std::uint16_t, ContactProblem::most> of_contact = of_contact_;
  const std::size_t count = count_;
  const bool rides = rides_;
  const bool led = in_smaller_parts(p_hat, q_old, far, parts, q_);
  if (!went_in(q_old) && led) return true;
  if (looks_ <= 0) return false;
  let_go(1.0);
  squeezed_ = false;
  q_ = found;
  contacts_ = contacts;
  of_contact_ = of_contact;
  count_ = count;
  rides_ = rides;
  collected_ = true;
  return true;
}

// Whether the contacts' work since q(k−1) is above 0 by more than what is of second order in the step: the way of a
// point that turns by θ at a lever bends by θ² lever/2, a normal turns by θ while the point goes on by s, and something
// round falls off by s²/2r. That is so of solutions on another side than the one that the tool came to: of a face, say,
// which it was below and beside. An object that moves does honest work, too: with it only what the tool moves relative
// to it counts.
bool RigidWorld::gives_energy(const ToolPose& q_old) noexcept {
  if (!collected_) collect_contacts(q_);
  if (count_ == 0) return false;
  const View now = view(q_), old = view(q_old);
  double work = 0.0, bends = 0.0;
  const double turned_W = rotation_vector(q_.orientation * q_old.orientation.conjugate()).norm();
  see_slip(q_, q_old);
  for (std::size_t k = 0; k < count_; ++k) {
    const PoseContact& contact = contacts_[k];
    const double force = contact.force_W.norm();
    if (force == 0.0) continue;
    const std::uint16_t entry = of_contact_[k];
    const Vec3 way = goes(entry) ? slip_on(entry, contact.point_W - q_.position)
                                 : Vec3(contact.point_W - old * now.to_T(contact.point_W));
    const double s = way.norm(), lever = (contact.point_W - q_.position).norm();
    const double turned = goes(entry) ? moving(entry).turned.norm() : turned_W;
    work += contact.force_W.dot(way);
    bends += force * (turned * (0.5 * turned * lever + turns_[k] * s) + 0.5 * bend_[k] * s * s);
  }
  return work > bends + kNothing_J;
}

double RigidWorld::bend_per_m(const Pair& pair) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const Solid* other = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  double bend = own.radius > 0.0 ? 1.0 / own.radius : 0.0;
  if (other != nullptr && other->radius > 0.0) bend += 1.0 / other->radius;
  if (pair.kind >= Kind::side_point) {
    for (const auto* cylinder : {&shared_->parts[pair.part].cylinder, &shared_->entries[pair.entry].cylinder}) {
      if (*cylinder) bend += 1.0 / (*cylinder)->radius;
    }
  }
  return bend;
}

// Of the angle γ at which two rims cross; 1: the contact is of others. Where a point of one goes across the other by s,
// the place of contact goes along by up to s/sin γ, on circles that bend: their gap bends by up to (1/r + 1/r')/sin² γ.
// Their normal is across both, and turns by up to θ/sin γ where one turns by θ.
double RigidWorld::sine_of_rims(const Found& found, const ToolPose& pose) const noexcept {
  const Pair& pair = pairs_[found.pair];
  if (pair.kind != Kind::rims) return 1.0;
  const Vec3& n = found.touch.normal;
  const Vec3 own = pose.orientation * shared_->parts[pair.part].cylinder->axis;
  Vec3 other = shared_->entries[pair.entry].cylinder->axis;
  if (moves(pair.entry)) other = moving(pair.entry).mover.at().R * other;
  const Vec3 along_own = own.cross(n), along_other = other.cross(n);
  const double lengths = along_own.norm() * along_other.norm();
  return lengths > kAlong ? std::max(along_own.cross(along_other).norm() / lengths, kAlong) : kAlong;
}

void RigidWorld::collect_contacts(const ToolPose& pose) noexcept {
  count_ = 0;
  collected_ = true;
  rides_ = false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    const Found& found = found_[of_linear_[k]];
    const Pair& pair = pairs_[found.pair];
    if (linear_[k].state == ContactState::open && found.touch.gap > kGap_m) continue;
    PoseContact& contact = contacts_[count_++];
    contact.object = shared_->entries[pair.entry].object.object;
    contact.part = pair.part;
    contact.feature = static_cast<std::int32_t>(pair.other);
    contact.slips = linear_[k].state == ContactState::slip;
    contact.point_W = found.touch.point;
    contact.normal_W = found.touch.normal;
    contact.force_W = axes_[k] * in_cone(linear_[k].f, linear_[k].mu);
    contact.gap_m = found.touch.gap;
    contact.friction = friction(pair);
    of_contact_[count_ - 1] = pair.entry;
    const double sine = sine_of_rims(found, pose);
    turns_[count_ - 1] = 1.0 / sine;
    bend_[count_ - 1] = bend_per_m(pair) / (sine * sine);
    rides_ = rides_ || goes(pair.entry);
  }
}

void RigidWorld::report(const ToolPose& q_old) noexcept {
  if (!collected_) collect_contacts(q_);
  if (count_ == 0) return;
  const double rounding =
      8.0 * std::numeric_limits<double>::epsilon() * (q_old.position.lpNorm<1>() + shared_->reach + extent_m_);
  if (rides_) return judge_slips(q_old, rounding);
  // What sticks stays, bit for bit.
  if (motion(q_, q_old) > rounding) return;
  q_ = q_old;
  for (std::size_t k = 0; k < count_; ++k) contacts_[k].slips = false;
}

}  // namespace proxarm::models
