#include "models/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/barred_way.hpp"
#include "models/corner.hpp"
#include "models/groove.hpp"
#include "models/settling.hpp"
#include "models/shared_hold.hpp"

namespace proxarm::models {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Two objects that hold the proxy between them, each by one of its features.
struct PairOfSurfaces {
  const Obstacle &a, &b;
  std::int32_t feature_a, feature_b;
};

struct SettledPair {
  bool settled = false;
  GrooveSolution groove;  // found: settled, and both press
  Vec3 r = Vec3::Zero();
  Obstacle::Tangent t_a, t_b;
};

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
      return solve_groove(out.t_a.surface, out.t_a.mu, out.t_b.surface, out.t_b.mu, line, p, q_a, q_b, by);
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
    if (out.settled) return out;  // flat
    out.t_a = n_a;
    out.t_b = n_b;
  }
  out.groove.found = false;
  return out;
}

}  // namespace

struct World::Choice {
  double distance2 = infinity;  // ‖r − p‖²
  Vec3 r = Vec3::Zero();
  std::array<Contact<3>, 3> contacts{};  // in shared_ where they share the force
  std::size_t count = 0;
  bool shared = false;
  bool free = false;  // nothing in the way of p
  bool resolved = true;

  [[nodiscard]] bool found() const noexcept { return distance2 < infinity; }
  // True if this one is better than what was there; then the caller fills in the contacts.
  bool better(const Vec3& p, const Vec3& at, std::size_t contact_count) noexcept {
    const double d2 = (at - p).squaredNorm();
    if (!(d2 < distance2)) return false;
    distance2 = d2;
    r = at;
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

// One more face of a mesh that is a candidate already; for what it does together with others, not alone.
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
}

void World::set_time(const StepTime& time) noexcept {
  for (const std::size_t i : moving_) entries_[i].obstacle->set_time(time.time_s, time.period_s);
}

// All obstacles that the step can meet. What a step does stays within the ball whose diameter is the way from q to p
// (the force on it never does work: (r − p)ᵀ(r − q) ≤ 0), which around convex bodies of radius R is exceeded by ‖r −
// q‖²/2R at most; twice that ball covers it. `reach`: the least radius about the middle of that way.
double World::gather(const Vec3& p, const Vec3& q, double reach) noexcept {
  const Vec3 middle = 0.5 * (p + q);
  const double radius = std::max(reach, (p - q).norm() * (1.0 + 1e-9) + 1e-12 * (1.0 + p.lpNorm<1>()));
  near_.resize(near_fixed_);
  if (!((middle - near_centre_).norm() + radius <= near_radius_)) {
    // A millimetre more than needed, so that a proxy in contact asks once in many steps.
    near_radius_ = 2.0 * radius + 1e-3;
    near_centre_ = middle;
    near_.clear();
    for (const std::size_t i : unbounded_) {
      if (entries_[i].obstacle->distance(middle) <= near_radius_) near_.push_back(i);
    }
    tree_.within(middle, near_radius_, [&](std::size_t i) { near_.push_back(i); });
    std::sort(near_.begin(), near_.end());  // so that nothing depends on how they were found
    near_fixed_ = near_.size();
  }
  for (const std::size_t i : moving_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    if (obstacle.comes_within(middle, radius + (obstacle.carry(q) - q).norm())) near_.push_back(i);
  }
  return radius;
}

void World::add_candidates(double K, const Vec3& p, const Vec3& q, Candidates& candidates) const noexcept {
  for (const std::size_t i : near_) {
    const Obstacle::Step s = entries_[i].obstacle->step(K, p, q);
    if (s.touches) candidates.add(i, s);
  }
}

// Not straight, but over the edge where the obstacle lets go of the proxy on its way to p; all others have to let it
// pass there, too.
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
    // What holds the proxy by one face may be in its way with another, if it is a mesh; alone it has seen to that.
    Vec3 normal;
    if (member && (contacts.size() < 2 || !obstacle.parts(obstacle.carry(q), r, normal))) continue;
    const bool presses = !member && soft_ && obstacle.presses_at(r);
    if (!member && !presses && !obstacle.excludes(obstacle.carry(q), r)) continue;
    if (!member && !presses && candidates.around && gets_around(obstacle, p, q, r)) continue;
    all = false;
    const bool known = candidates.has(i);
    if (known && !member && !obstacle.parts(obstacle.carry(q), r, normal)) continue;
    // It isn't in the way of p, but of the trial: what it would do to that tells its feature.
    Obstacle::Step s = obstacle.step(K, r, q);
    if (known) {
      add_face(i, s, candidates);
    } else {
      s.touches = s.touches && obstacle.step(K, p, q).touches;
      candidates.add(i, s);
    }
  }
  return all;
}

void World::try_singles(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
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
}

void World::try_pairs(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
  for (std::size_t c = 1; c < candidates.count; ++c) {
    if (elastic_[candidates.index[c]]) continue;
    for (std::size_t d = 0; d < c; ++d) {
      if (elastic_[candidates.index[d]]) continue;
      const bool in_order = candidates.index[d] <= candidates.index[c];
      const std::size_t own[2] = {in_order ? d : c, in_order ? c : d};
      const std::size_t m[2] = {candidates.index[own[0]], candidates.index[own[1]]};
      const PairOfSurfaces pair{*entries_[m[0]].obstacle, *entries_[m[1]].obstacle, candidates.alone[own[0]].feature,
                                candidates.alone[own[1]].feature};
      SettledPair s = settle(pair, p, q, q, GrooveSearch::first_root);
      if (s.settled && !s.groove.found) s = settle(pair, p, q, s.r, GrooveSearch::all_roots);
      if (!s.groove.found || !fits(q, s.r, m, candidates, K, p) || !choice.better(p, s.r, 2)) continue;
      const bool slips[2] = {s.groove.slips1, s.groove.slips2};
      const Obstacle::Tangent* const tangents[2] = {&s.t_a, &s.t_b};
      for (std::size_t j = 0; j < 2; ++j) {
        const Entry& entry = entries_[m[j]];
        choice.contacts[j] = {entry.object, entry.feature < 0 ? candidates.alone[own[j]].feature : entry.feature,
                              slips[j], tangents[j]->surface.normal()};
      }
    }
  }
}

void World::try_triples(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept {
  for (std::size_t c = 2; c < candidates.count; ++c) {
    for (std::size_t d = 1; d < c; ++d) {
      for (std::size_t e = 0; e < d; ++e) {
        const std::size_t own[3] = {e, d, c};
        const std::size_t m[3] = {candidates.index[e], candidates.index[d], candidates.index[c]};
        if (elastic_[m[0]] || elastic_[m[1]] || elastic_[m[2]]) continue;
        Vec3 r = q, carried[3];
        const Vec3* q_each[3];
        for (std::size_t j = 0; j < 3; ++j) {
          carried[j] = entries_[m[j]].obstacle->carry(q);
          q_each[j] = &carried[j];
        }
        const auto tangent = [&](std::size_t j) {
          return entries_[m[j]].obstacle->tangent(r, candidates.alone[own[j]].feature);
        };
        std::array<Obstacle::Tangent, 3> t{tangent(0), tangent(1), tangent(2)};
        CornerSolution s;
        double last_move = infinity;
        for (int k = 0; k < most_settling; ++k) {
          const FlatSurface<3>* const surfaces[3] = {&t[0].surface, &t[1].surface, &t[2].surface};
          const double mu[3] = {t[0].mu, t[1].mu, t[2].mu};
          const CornerPoint point(t[0].surface, t[1].surface, t[2].surface);
          s = solve_corner(surfaces, mu, point, p, q_each);
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
        if (!s.found || !fits(q, r, m, candidates, K, p) || !choice.better(p, r, 3)) continue;
        for (std::size_t j = 0; j < 3; ++j) {
          const Entry& entry = entries_[m[j]];
          choice.contacts[j] = {entry.object, entry.feature < 0 ? candidates.alone[own[j]].feature : entry.feature,
                                s.slips[j], t[j].surface.normal()};
        }
      }
    }
  }
}

// All candidates at once, where one of them has an elastic layer: those that press share the force.
void World::try_together(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept {
  const std::span<const std::size_t> all{candidates.index.data(), candidates.count};
  if (std::none_of(all.begin(), all.end(), [this](std::size_t i) { return elastic_[i]; })) return;
  SharedHold hold;
  hold.count = candidates.count;
  hold.budget = hold_budget_;
  for (std::size_t c = 0; c < hold.count; ++c) {
    hold.obstacle[c] = entries_[candidates.index[c]].obstacle.get();
    hold.step[c] = candidates.alone[c];
  }
  const bool found = hold.solve(K, p, q);
  hold_budget_ = hold.budget;
  if (!found || !fits(q, hold.r, all, candidates, K, p)) return;
  choice.better(p, hold.r, 0);
  choice.shared = true;
  for (std::size_t c = 0; c < hold.count; ++c) {
    const Obstacle::Step& s = hold.step[c];
    if (!s.touches) continue;
    const Entry& entry = entries_[candidates.index[c]];
    shared_[choice.count++] = {entry.object, entry.feature < 0 ? s.feature : entry.feature, s.slips, s.normal};
    choice.resolved = choice.resolved && s.resolved;
  }
}

bool World::search(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept {
  do {
    candidates.grew = false;
    try_singles(K, p, q, candidates, choice);
    if (choice.found()) return true;
    if (candidates.grew) continue;
    try_pairs(K, p, q, candidates, choice);
    if (choice.found()) return true;
    if (candidates.grew) continue;
    try_triples(K, p, q, candidates, choice);
    if (choice.found()) return true;
    if (!soft_ || candidates.grew) continue;
    try_together(K, p, q, candidates, choice);
    if (choice.found()) return true;
  } while (candidates.grew);
  return false;
}

// Whether r can be where a proxy from q ends, for all that is near.
bool World::is_free(const Vec3& q, const Vec3& r) const noexcept {
  return std::none_of(near_.begin(), near_.end(), [&](std::size_t i) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    return obstacle.excludes(obstacle.carry(q), r);
  });
}

// Nothing is complete: the proxy stays where it is if it may, else it is brought out of the nearest thing.
void World::hold(const Vec3& p, const Vec3& q, const Candidates& candidates, Choice& choice) const noexcept {
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

// False where no set of contacts was complete.
bool World::solve(double K, const Vec3& p, const Vec3& q, Choice& choice) noexcept {
  Candidates& candidates = candidates_;
  candidates.clear();
  add_candidates(K, p, q, candidates);
  choice.free = candidates.count == 0;
  if (choice.free) {
    choice.r = p;
    return true;
  }
  if (search(K, p, q, candidates, choice)) return choice.resolved;
  candidates.around = true;
  if (search(K, p, q, candidates, choice)) return choice.resolved;
  // A tool so deep that tangent planes lead nowhere (beyond the radius of a curved surface): as far as a shorter step
  // leads, or where it was.
  Vec3 nearer = p;
  for (int k = 0; k < 6 && !choice.found(); ++k) {
    nearer = 0.5 * (nearer + q);
    Candidates fewer;
    add_candidates(K, nearer, q, fewer);
    if (fewer.count > 0) search(K, nearer, q, fewer, choice);
  }
  if (!choice.found()) hold(p, q, candidates, choice);
  return false;
}

World::Way World::go_straight(const Vec3& x, const Vec3& y) noexcept {
  Way way{y, false, {}};
  gather(y, x, 0.0);
  for (const std::size_t i : near_) {
    const Obstacle& obstacle = *entries_[i].obstacle;
    if (!obstacle.bars(x, way.end)) continue;
    const Obstacle::Step s = obstacle.step(1.0, way.end, x);
    way.contact = {entries_[i].object, entries_[i].feature < 0 ? s.feature : entries_[i].feature, false,
                   s.touches ? s.normal : Vec3((x - y).normalized())};
    way.stopped = true;
    way.end = end_of_free_way(obstacle, x, way.end);
  }
  return way;
}

Vec3 World::operator()(double K, const Vec3& p, const Vec3& q) noexcept {
  count_ = 0;
  squeezed_ = false;
  if ((p - clear_at_).squaredNorm() < clearance_ * clearance_ &&
      (q - clear_at_).squaredNorm() < clearance_ * clearance_ && clearance_ > 0.0) {
    return p;
  }
  double radius = gather(p, q, 0.0);
  hold_budget_ = SharedHold::whole_budget;
  Choice choice;
  bool found = solve(K, p, q, choice);
  // What moves may carry the proxy, or others have squeezed it into something that it comes out of: then it may end
  // where nobody has looked yet.
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
    // Nothing in the way. How much room is there? Only what stands still is remembered.
    double room = infinity;
    for (const std::size_t i : unbounded_) room = std::min(room, entries_[i].obstacle->distance(p));
    clearance_ = tree_.nearest(p, room, [&](std::size_t i) { return entries_[i].obstacle->distance(p); });
    clearance_ -= 1e-12 * (1.0 + p.lpNorm<1>());  // rounding of distances
    clear_at_ = p;
  }
  return choice.r;
}

}  // namespace proxarm::models
