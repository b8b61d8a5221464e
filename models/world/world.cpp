#include "models/world/world.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "models/obstacles/sweep.hpp"
#include "models/surfaces/contact_search.hpp"
#include "models/surfaces/corner.hpp"
#include "models/surfaces/groove.hpp"
#include "models/world/settling.hpp"
#include "models/world/shared_support.hpp"

namespace proxarm::models {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// If up to `crowd` obstacles press, the search tries all their pairs and triples, which are 10 in all. If more
// obstacles press, the search uses only `chosen` of them, which gives 20 pairs and triples of some microseconds each.
constexpr std::size_t crowd = 4, chosen = 5;
constexpr int most_attempts = 64;

// Two obstacles that hold the proxy between them, each by one feature.
struct PairOfSurfaces {
  const Obstacle &a, &b;
  std::int32_t feature_a, feature_b;
};

struct SettledPair {
  bool settled = false;
  // `found`: the iteration has settled, and both contacts press.
  GrooveSolution groove;
  Vec3 r = Vec3::Zero();
  Obstacle::Tangent t_a, t_b;
};

// Solves the groove between two tangent planes, and repeats this with the tangent planes at each solution until r
// settles. During the iteration a contact may pull. `found` is true only if both contacts press at the end.
SettledPair settle(const PairOfSurfaces& pair, const Vec3& p, const Vec3& q, const Vec3& from,
                   GrooveSearch search) noexcept {
  const Vec3 q_a = pair.a.carry(q), q_b = pair.b.carry(q);
  Settling settling(from);
  SettledPair out{.groove = {},
                  .r = from,
                  .t_a = pair.a.tangent(from, pair.feature_a),
                  .t_b = pair.b.tangent(from, pair.feature_b)};
  for (int k = 0; k < most_settling; ++k) {
    const GrooveLine line(out.t_a.surface, out.t_b.surface, settling.at());
    const auto solve_by = [&](GrooveSearch by) {
      return solve_groove({out.t_a.surface, out.t_a.mu, q_a}, {out.t_b.surface, out.t_b.mu, q_b}, line, p, by);
    };
    out.groove = solve_by(search);
    const bool presses = out.groove.found;
    if (!presses) out.groove = solve_by(GrooveSearch::may_pull);
    out.r = out.groove.r;
    if (!out.groove.found || !out.r.allFinite()) break;
    out.groove.found = presses;
    out.settled = settling.take(out.r);
    if (out.settled) return out;
    const Obstacle::Tangent n_a = pair.a.tangent(settling.at(), pair.feature_a),
                            n_b = pair.b.tangent(settling.at(), pair.feature_b);
    out.settled = n_a.surface.normal() == out.t_a.surface.normal() && n_b.surface.normal() == out.t_b.surface.normal();
    if (out.settled) return out;  // both surfaces are flat here
    out.t_a = n_a;
    out.t_b = n_b;
  }
  out.groove.found = false;
  return out;
}

// Up to three planes that hold a point r. r is the point nearest to p on the free side of these planes.
class HoldingPlanes {
 public:
  // Adds one more plane and drops planes that no longer hold r. Returns false if it finds no point.
  bool exchange(const Obstacle::Step& plane, const Vec3& p, Vec3& r) noexcept {
    std::array<const Obstacle::Step*, 4> all{&plane};
    for (std::size_t i = 0; i < count_; ++i) all[i + 1] = planes_[i];
    // Tries all sets of the planes, the smallest sets first, and takes the first set whose point is on the free side of
    // all planes.
    const unsigned sets = 1u << (count_ + 1);
    for (int size = 1; size <= 3; ++size) {
      for (unsigned set = 1; set < sets; ++set) {
        if (std::popcount(set) == size && hold(all, set, p, r)) return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool has(const Obstacle::Step& plane) const noexcept {
    const auto end = planes_.begin() + static_cast<std::ptrdiff_t>(count_);
    return std::find(planes_.begin(), end, &plane) != end;
  }

 private:
  bool hold(const std::array<const Obstacle::Step*, 4>& all, unsigned set, const Vec3& p, Vec3& r) noexcept {
    std::array<const Obstacle::Step*, 3> planes{};
    Mat3 G = Mat3::Identity();  // dot products of the normals; identity beyond the number of planes in the set
    Vec3 depth = Vec3::Zero();
    std::size_t n = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if ((set & 1u << i) == 0) continue;
      planes[n] = all[i];
      const auto row = static_cast<Eigen::Index>(n);
      depth[row] = all[i]->normal.dot(all[i]->r - p);
      for (std::size_t j = 0; j < n; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        G(row, column) = G(column, row) = planes[j]->normal.dot(all[i]->normal);
      }
      ++n;
    }
    const Vec3 share = G.ldlt().solve(depth);
    if (!share.allFinite() || share.minCoeff() < 0.0) return false;
    Vec3 x = p;
    for (std::size_t i = 0; i < n; ++i) x += share[static_cast<Eigen::Index>(i)] * planes[i]->normal;
    const double rounding = 1e-9 * (x - p).norm();
    for (std::size_t i = 0; i <= count_; ++i) {
      if (all[i]->normal.dot(all[i]->r - x) > rounding) return false;
    }
    planes_ = planes;
    count_ = n;
    r = x;
    return true;
  }

  std::array<const Obstacle::Step*, 3> planes_{};
  std::size_t count_ = 0;
};

}  // namespace

struct World::Choice : NearestSet {
  std::array<Contact<3>, 3> contacts{};  // unused if `shared`: the contacts are then in shared_
  std::size_t count = 0;
  bool shared = false;
  bool free = false;  // the proxy reaches p without contact
  bool resolved = true;

  // Returns true if this point is nearer to p than the best point so far; the caller then fills in the contacts.
  bool better(const Vec3& p, const Vec3& at, std::size_t contact_count) noexcept {
    if (!improve(p, at)) return false;
    count = contact_count;
    return true;
  }
};

bool World::Candidates::has(std::size_t i) const noexcept {
  const auto end = index.begin() + static_cast<std::ptrdiff_t>(count);
  return std::find(index.begin(), end, i) != end;
}

void World::Candidates::add(std::size_t i, const Obstacle::Step& step) noexcept {
  if (count == most || has(i)) return;
  index[count] = i;
  alone[count++] = step;
  grew = true;
}

// Adds another face of a mesh that is already a candidate. This face is used only together with other candidates,
// because Obstacle::step has already solved all faces of the mesh alone.
void World::add_face(std::size_t i, const Obstacle::Step& step, Candidates& candidates) noexcept {
  if (candidates.count == Candidates::most || !step.touches) return;
  for (std::size_t c = 0; c < candidates.count; ++c) {
    if (candidates.index[c] == i && candidates.alone[c].feature == step.feature) return;
  }
  candidates.index[candidates.count] = i;
  candidates.alone[candidates.count] = step;
  candidates.alone[candidates.count++].touches = false;
  candidates.grew = true;
}

World::World(std::vector<Entry> entries) : entries_(std::move(entries)) {
  std::vector<BoundsTree::Leaf> leaves;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    const Bounds bounds = obstacle.bounds();
    elastic_.push_back(obstacle.layer().soft());
    soft_ = soft_ || elastic_.back();
    if (obstacle.moves()) {
      moving_.push_back(i);
    } else if (bounds.finite()) {
      leaves.push_back({bounds, i});
    } else {
      unbounded_.push_back(i);
    }
  }
  tree_ = BoundsTree(std::move(leaves));
  near_.reserve(entries_.size());
  pressed_.reserve(entries_.size());
}

void World::set_time(const StepTime& time) noexcept {
  for (const std::size_t i : moving_) entries_[i].obstacle->set_time(time.time_s, time.period_s);
}

// Gathers into near_ all obstacles that the step can meet. Returns the radius of the searched ball around (p + q)/2,
// which is at least `reach`. The radius is chosen as follows:
// 1. In convex free space (r − p)ᵀ(r − q) ≤ 0, so r is in the ball whose diameter is the segment from q to p (Thales).
// 2. Around a convex solid of radius R, r may be outside this ball by ‖r − q‖²/2R. Twice the ball's radius covers this.
// 3. If layers that spring back or moving objects take r farther, operator() gathers again.
double World::gather(const Vec3& p, const Vec3& q, double reach) noexcept {
  const Vec3 middle = 0.5 * (p + q);
  const double radius = std::max(reach, (p - q).norm() * (1.0 + 1e-9) + 1e-12 * (1.0 + p.lpNorm<1>()));
  near_.resize(near_fixed_);
  if (!((middle - near_centre_).norm() + radius <= near_radius_)) {
    // near_ is gathered for twice the radius plus a millimetre. So for a proxy in contact, which moves by micrometres,
    // the tree is rarely searched. A larger ball would make each step test more obstacles.
    near_radius_ = 2.0 * radius + 1e-3;
    near_centre_ = middle;
    near_.clear();
    for (const std::size_t i : unbounded_) {
      if (entries_[i].obstacle->distance(middle) <= near_radius_) near_.push_back(i);
    }
    tree_.within(middle, near_radius_, [&](std::size_t i) { near_.push_back(i); });
    std::sort(near_.begin(), near_.end());  // so that results don't depend on the order in the tree
    near_fixed_ = near_.size();
  }
  for (const std::size_t i : moving_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    if (obstacle.comes_within(middle, radius + (obstacle.carry(q) - q).norm())) near_.push_back(i);
  }
  return radius;
}

void World::add_candidates(double K, const Vec3& p, const Vec3& q, Candidates& candidates) noexcept {
  pressed_.clear();
  for (const std::size_t i : near_) {
    const Obstacle::Step s = entries_[i].obstacle->step(K, p, q);
    if (s.touches) pressed_.push_back({i, s});
  }
  if (pressed_.size() > crowd && !soft_) choose(K, p, q);
  for (const Pressed& pressed : pressed_) candidates.add(pressed.index, pressed.step);
}

// Adds to pressed_ the obstacles that block the path to r, although they don't block the path to p. Returns whether it
// added any.
bool World::add_those_at(double K, const Vec3& p, const Vec3& q, const Vec3& r) noexcept {
  const std::size_t before = pressed_.size();
  for (const std::size_t i : near_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    if (!obstacle.excludes(obstacle.carry(q), r)) continue;
    const auto known = [i](const Pressed& pressed) { return pressed.index == i; };
    if (std::any_of(pressed_.begin(), pressed_.end(), known)) continue;
    Obstacle::Step s = obstacle.step(K, r, q);
    if (!s.touches) continue;
    s.touches = obstacle.step(K, p, q).touches;
    pressed_.push_back({i, s});
  }
  return pressed_.size() > before;
}

// Reduces pressed_ to `chosen` obstacles: the obstacles that would hold the proxy without friction, and the obstacles
// that are nearest after these.
// 1. Each obstacle is replaced by a plane: the tangent plane at the end of the obstacle's step alone.
// 2. p is projected onto the polyhedron of these planes by a dual method. It starts at r = p.
// 3. Each exchange adds the plane that r is deepest behind to the planes that hold r, and moves r to the point nearest
//    to p on the free side of the holding planes.
// 4. When r is on the free side of all planes, obstacles that block the path to r are added. The exchanges end when no
//    such obstacle exists.
// 5. The distance from r to p grows in each exchange, so no set of planes occurs twice. Depths of up to a billionth of
//    this distance are ignored.
void World::choose(double K, const Vec3& p, const Vec3& q) noexcept {
  constexpr int most_exchanges = 64;
  constexpr double passed = 1e-9;
  HoldingPlanes holding;
  Vec3 r = p;
  const auto depth = [&r](const Pressed& plane) { return plane.step.normal.dot(plane.step.r - r); };
  const auto deeper = [&](const Pressed& a, const Pressed& b) { return depth(a) > depth(b); };
  for (int k = 0; k < most_exchanges; ++k) {
    const Pressed& deepest = *std::min_element(pressed_.begin(), pressed_.end(), deeper);
    if (depth(deepest) > passed * (r - p).norm() ? !holding.exchange(deepest.step, p, r) : !add_those_at(K, p, q, r))
      break;
  }
  likely_count_ = 0;
  for (const Pressed& pressed : pressed_) {
    if (holding.has(pressed.step)) likely_[likely_count_++] = pressed.index;
  }
  // Planes that hold r have depth zero, and all other planes have smaller depths. Equal depths are ordered by index,
  // because results depend on the order.
  std::partial_sort(pressed_.begin(), pressed_.begin() + chosen, pressed_.end(),
                    [&](const Pressed& a, const Pressed& b) {
                      return depth(a) != depth(b) ? depth(a) > depth(b) : a.index < b.index;
                    });
  pressed_.resize(chosen);
  std::sort(pressed_.begin(), pressed_.end(), [](const Pressed& a, const Pressed& b) { return a.index < b.index; });
}

// Whether the proxy gets from q to r around an obstacle that blocks the straight path. The proxy goes over the edge of
// the obstacle. All other obstacles must allow a proxy at this edge, too.
bool World::gets_around(const Obstacle& obstacle, const Vec3& p, const Vec3& q, const Vec3& r) const noexcept {
  const Vec3 edge = obstacle.detour(p, q);
  if (edge == q || obstacle.excludes(edge, r)) return false;
  return std::all_of(near_.begin(), near_.end(), [&](std::size_t i) {
    const Obstacle& other = *entries_[i].obstacle;
    return &other == &obstacle || (!other.excludes(other.carry(q), edge) && !other.excludes(edge, r));
  });
}

bool World::fits(const Vec3& q, const Vec3& r, std::span<const std::size_t> contacts, Candidates& candidates, double K,
                 const Vec3& p) const noexcept {
  bool all = true;
  for (const std::size_t i : near_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    const bool member = std::find(contacts.begin(), contacts.end(), i) != contacts.end();
    // A mesh that holds the proxy with one face may block its path with another face. For a mesh alone, the mesh's own
    // step has already solved this, so only sets of two and more obstacles are checked.
    Vec3 normal;
    if (member && (contacts.size() < 2 || !obstacle.parts(obstacle.carry(q), r, normal))) continue;
    const bool presses = !member && soft_ && obstacle.presses_at(r);
    if (!member && !presses && !obstacle.excludes(obstacle.carry(q), r)) continue;
    if (!member && !presses && candidates.around && gets_around(obstacle, p, q, r)) continue;
    all = false;
    const bool known = candidates.has(i);
    if (known && !member && !obstacle.parts(obstacle.carry(q), r, normal)) continue;
    // The obstacle blocks the path to r, although it doesn't block the path to p. The step towards r gives the feature.
    Obstacle::Step s = obstacle.step(K, r, q);
    if (known) {
      add_face(i, s, candidates);
    } else {
      // If the obstacle also blocks the path to p, but wasn't chosen from the crowd, its step towards p is used.
      const Obstacle::Step alone = obstacle.step(K, p, q);
      if (s.touches && alone.touches) s = alone;
      s.touches = alone.touches && s.touches;
      candidates.add(i, s);
    }
  }
  return all;
}

// Whether all these obstacles touch r. This is checked because pairs and triples are solved on planes, but a face
// exerts no force beyond its edges. The tolerance is between two scales: rounding is smaller for objects of up to a
// hundred metres, and a proxy that is 1e-12 m beyond a face's edge may count as held at the edge.
bool World::all_touch(const Vec3& r, std::span<const std::size_t> contacts) const noexcept {
  const double nothing = 1e-12 * (1.0 + r.lpNorm<1>());
  return std::all_of(contacts.begin(), contacts.end(),
                     [&](std::size_t i) { return std::abs(entries_[i].obstacle->distance(r)) <= nothing; });
}

StepResult World::try_singles(double K, const Vec3& p, const Vec3& q, Candidates& candidates,
                              Choice& choice) const noexcept {
  for (std::size_t c = 0; c < candidates.count; ++c) {
    const Obstacle::Step& s = candidates.alone[c];
    const std::size_t i[1] = {candidates.index[c]};
    if (!s.touches || !fits(q, s.r, i, candidates, K, p) || !choice.better(p, s.r, 1)) continue;
    const Entry& entry = entries_[i[0]];
    choice.resolved = s.resolved;
    choice.count = entry.obstacle->contacts(K, p, q, s, choice.contacts);
    for (std::size_t j = 0; j < choice.count; ++j) {
      choice.contacts[j].object = entry.object;
      if (entry.feature >= 0) choice.contacts[j].feature = entry.feature;
    }
  }
  return choice.result(candidates.grew);
}

Contact<3> World::contact_of(const Candidates& candidates, std::size_t candidate, bool slips,
                             const Vec3& normal) const noexcept {
  const Entry& entry = entries_[candidates.index[candidate]];
  return {entry.object, entry.feature < 0 ? candidates.alone[candidate].feature : entry.feature, slips, normal};
}

void World::try_pair(double K, const Vec3& p, const Vec3& q, std::array<std::size_t, 2> own, Candidates& candidates,
                     Choice& choice) noexcept {
  if (!may_try()) return;
  if (candidates.index[own[0]] > candidates.index[own[1]]) std::swap(own[0], own[1]);
  const std::size_t m[2] = {candidates.index[own[0]], candidates.index[own[1]]};
  if (elastic_[m[0]] || elastic_[m[1]]) return;
  const PairOfSurfaces pair{*entries_[m[0]].obstacle, *entries_[m[1]].obstacle, candidates.alone[own[0]].feature,
                            candidates.alone[own[1]].feature};
  SettledPair s = settle(pair, p, q, q, GrooveSearch::first_root);
  // A contact that pulls at the first root may press at another root.
  if (s.settled && !s.groove.found) s = settle(pair, p, q, s.r, GrooveSearch::all_roots);
  if (!s.groove.found || !fits(q, s.r, m, candidates, K, p) || !all_touch(s.r, m) || !choice.better(p, s.r, 2)) return;
  choice.contacts[0] = contact_of(candidates, own[0], s.groove.slips1, s.t_a.surface.normal());
  choice.contacts[1] = contact_of(candidates, own[1], s.groove.slips2, s.t_b.surface.normal());
}

// Solves the corner of three tangent planes, and repeats this with the tangent planes at each new corner until the
// corner settles.
void World::try_triple(double K, const Vec3& p, const Vec3& q, const std::array<std::size_t, 3>& own,
                       Candidates& candidates, Choice& choice) noexcept {
  if (!may_try()) return;
  const std::size_t m[3] = {candidates.index[own[0]], candidates.index[own[1]], candidates.index[own[2]]};
  if (elastic_[m[0]] || elastic_[m[1]] || elastic_[m[2]]) return;
  Vec3 r = q, carried[3];
  for (std::size_t j = 0; j < 3; ++j) carried[j] = entries_[m[j]].obstacle->carry(q);
  const auto tangent = [&](std::size_t j) {
    return entries_[m[j]].obstacle->tangent(r, candidates.alone[own[j]].feature);
  };
  std::array<Obstacle::Tangent, 3> t{tangent(0), tangent(1), tangent(2)};
  CornerSolution s;
  double last_move = infinity;
  for (int k = 0; k < most_settling; ++k) {
    const CornerPoint point(t[0].surface, t[1].surface, t[2].surface);
    s = solve_corner({PlaneContact{t[0].surface, t[0].mu, carried[0]}, PlaneContact{t[1].surface, t[1].mu, carried[1]},
                      PlaneContact{t[2].surface, t[2].mu, carried[2]}},
                     point, p);
    if (!point.exists || !s.r.allFinite()) {
      s.found = false;
      break;
    }
    const double move = (s.r - r).norm();
    r = s.r;
    const std::array<Obstacle::Tangent, 3> next{tangent(0), tangent(1), tangent(2)};
    bool flat = true;
    for (std::size_t j = 0; j < 3; ++j) flat = flat && next[j].surface.normal() == t[j].surface.normal();
    const double contraction = last_move < infinity ? move / last_move : infinity;
    if (flat || has_settled(move, move <= 0.5 * last_move, contraction, r)) break;
    s.found = false;
    last_move = move;
    t = next;
  }
  if (!s.found || !fits(q, r, m, candidates, K, p) || !all_touch(r, m) || !choice.better(p, r, 3)) return;
  for (std::size_t j = 0; j < 3; ++j) {
    choice.contacts[j] = contact_of(candidates, own[j], s.slips[j], t[j].surface.normal());
  }
}

// In a crowd, tries single obstacles first, and then the set that would hold the proxy without friction. Other sets are
// tried later, because each set that fails adds more obstacles of the crowd to the candidates.
bool World::try_likely(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept {
  try_singles(K, p, q, candidates, choice);
  if (choice.found() || likely_count_ < 2) return choice.found();
  std::array<std::size_t, 3> own{};
  for (std::size_t i = 0; i < likely_count_; ++i) {
    const auto end = candidates.index.begin() + static_cast<std::ptrdiff_t>(candidates.count);
    const auto at = std::find(candidates.index.begin(), end, likely_[i]);
    if (at == end) return false;
    own[i] = static_cast<std::size_t>(at - candidates.index.begin());
  }
  std::sort(own.begin(), own.begin() + static_cast<std::ptrdiff_t>(likely_count_));
  if (likely_count_ == 2) {
    try_pair(K, p, q, {own[0], own[1]}, candidates, choice);
  } else {
    try_triple(K, p, q, own, candidates, choice);
  }
  return choice.found();
}

// Tries all candidates at once if one of them has an elastic layer. The candidates that press share the force.
void World::try_together(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept {
  const std::span<const std::size_t> all{candidates.index.data(), candidates.count};
  if (std::none_of(all.begin(), all.end(), [this](std::size_t i) { return elastic_[i]; })) return;
  SharedSupport support;
  support.count = candidates.count;
  support.budget = support_budget_;
  for (std::size_t c = 0; c < support.count; ++c) {
    support.obstacle[c] = entries_[candidates.index[c]].obstacle.get();
    support.step[c] = candidates.alone[c];
  }
  const bool found = support.solve(K, p, q);
  support_budget_ = support.budget;
  if (!found || !fits(q, support.r, all, candidates, K, p)) return;
  choice.better(p, support.r, 0);
  choice.shared = true;
  for (std::size_t c = 0; c < support.count; ++c) {
    const Obstacle::Step& s = support.step[c];
    if (!s.touches) continue;
    const Entry& entry = entries_[candidates.index[c]];
    shared_[choice.count++] = {entry.object, entry.feature < 0 ? s.feature : entry.feature, s.slips, s.normal};
    choice.resolved = choice.resolved && s.resolved;
  }
}

bool World::search(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept {
  const auto try_pairs = [&] {
    try_each_pair(candidates.count, [&](std::size_t i, std::size_t j) {
      try_pair(K, p, q, {i, j}, candidates, choice);
      return StepResult::no_progress;
    });
    return choice.result(candidates.grew);
  };
  const auto try_triples = [&] {
    try_each_triple(candidates.count, [&](std::size_t i, std::size_t j, std::size_t k) {
      try_triple(K, p, q, {i, j, k}, candidates, choice);
      return StepResult::no_progress;
    });
    return choice.result(candidates.grew);
  };
  return search_contacts(
      [&] {
        candidates.grew = false;
        return true;
      },
      [&] { return try_singles(K, p, q, candidates, choice); }, try_pairs, try_triples,
      [&] {
        if (soft_) try_together(K, p, q, candidates, choice);
        return choice.result(candidates.grew);
      });
}

// Whether all near obstacles allow a proxy that comes from q to end at r.
bool World::is_free(const Vec3& q, const Vec3& r) const noexcept {
  return std::none_of(near_.begin(), near_.end(), [&](std::size_t i) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    return obstacle.excludes(obstacle.carry(q), r);
  });
}

// Ends a step for which no set is complete. The proxy stays at q if all obstacles allow a proxy at q. Otherwise it
// takes the step of the single obstacle whose step ends nearest to p.
void World::stay(const Vec3& p, const Vec3& q, const Candidates& candidates, Choice& choice) const noexcept {
  const bool allowed = is_free(q, q);
  for (std::size_t c = 0; c < candidates.count; ++c) {
    const Obstacle::Step& s = candidates.alone[c];
    if (!s.touches) continue;
    const Entry& entry = entries_[candidates.index[c]];
    const Contact<3> contact{entry.object, entry.feature < 0 ? s.feature : entry.feature, false, s.normal};
    if (allowed) {
      if (choice.count < choice.contacts.size()) choice.contacts[choice.count++] = contact;
    } else if (choice.better(p, s.r, 1)) {
      choice.contacts[0] = contact;
    }
  }
  if (allowed || choice.count == 0) choice.r = q;
}

double World::distance(const Vec3& x) const noexcept {
  double least = infinity;
  for (const std::size_t i : unbounded_) least = std::min(least, entries_[i].obstacle->distance(x));
  for (const std::size_t i : moving_) least = std::min(least, entries_[i].obstacle->distance(x));
  return tree_.nearest(x, least, [&](std::size_t i) { return entries_[i].obstacle->distance(x); });
}

// Finds the point at which the step ends, and the contacts at this point. Returns false if no set of contacts was
// complete.
bool World::solve(double K, const Vec3& p, const Vec3& q, Choice& choice) noexcept {
  Candidates& candidates = candidates_;
  candidates.clear();
  add_candidates(K, p, q, candidates);
  const bool crowded = candidates.count > crowd && !soft_;
  attempts_left_ = crowded ? most_attempts : std::numeric_limits<int>::max();
  choice.free = candidates.count == 0;
  if (choice.free) {
    choice.r = p;
    return true;
  }
  if (crowded && try_likely(K, p, q, candidates, choice)) return choice.resolved;
  if (search(K, p, q, candidates, choice)) return choice.resolved;
  candidates.around = true;
  if (search(K, p, q, candidates, choice)) return choice.resolved;
  // Beyond the radius of a curved surface, or in a long step past several objects, the iteration on tangent planes may
  // find nothing. The proxy then goes as far as a shorter step leads: p is moved halfway towards q, up to six times.
  Vec3 nearer = p;
  for (int k = 0; k < 6 && !choice.found(); ++k) {
    nearer = 0.5 * (nearer + q);
    Candidates fewer;
    add_candidates(K, nearer, q, fewer);
    if (fewer.count > 0) {
      search(K, nearer, q, fewer, choice);
    } else {
      choice.improve(p, nearer);  // the path of this shorter step is free
    }
  }
  if (!choice.found()) stay(p, q, candidates, choice);
  return false;
}

World::Sweep World::sweep(const Vec3& x, const Vec3& y) noexcept {
  Sweep out{y, false, {}};
  gather(y, x, 0.0);
  for (const std::size_t i : near_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    if (!obstacle.bars(x, out.end)) continue;
    const Obstacle::Step s = obstacle.step(1.0, out.end, x);
    out.contact = {entries_[i].object, entries_[i].feature < 0 ? s.feature : entries_[i].feature, false,
                   s.touches ? s.normal : Vec3((x - y).normalized())};
    out.stopped = true;
    out.end = models::sweep(obstacle, x, out.end);
  }
  return out;
}

Vec3 World::operator()(double K, const Vec3& p, const Vec3& q) noexcept {
  count_ = 0;
  squeezed_ = false;
  if ((p - clear_at_).squaredNorm() < clearance_ * clearance_ &&
      (q - clear_at_).squaredNorm() < clearance_ * clearance_ && clearance_ > 0.0) {
    return p;
  }
  double radius = gather(p, q, 0.0);
  support_budget_ = SharedSupport::whole_budget;
  Choice choice;
  bool found = solve(K, p, q, choice);
  // A moving object, a layer that springs back, or an obstacle that the proxy has to leave may take r out of the
  // searched ball. Then the step is repeated with all obstacles near its end.
  for (std::size_t known = 0; known != near_.size() && !choice.free;) {
    known = near_.size();
    const double away = (choice.r - 0.5 * (p + q)).norm();
    if (away <= radius) break;
    radius = gather(p, q, 2.0 * away);
    choice = {};
    found = solve(K, p, q, choice);
  }
  if (!found) {
    ++unresolved_;
    squeezed_ = !moving_.empty() && !is_free(q, choice.r);
  }
  contacts_ = choice.contacts;
  count_ = choice.count;
  are_shared_ = choice.shared;
  if (choice.free && moving_.empty()) {
    // The step is free. The clearance at p is stored, so that later steps within it need no search. With moving objects
    // a stored clearance wouldn't remain true.
    double room = infinity;
    for (const std::size_t i : unbounded_) room = std::min(room, entries_[i].obstacle->distance(p));
    clearance_ = tree_.nearest(p, room, [&](std::size_t i) { return entries_[i].obstacle->distance(p); });
    clearance_ -= 1e-12 * (1.0 + p.lpNorm<1>());  // rounding of distances
    clear_at_ = p;
  }
  return choice.r;
}

}  // namespace proxarm::models
