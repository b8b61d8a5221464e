// A step of many parts among objects that move.
//
// Parts are as short as a thin tool or a thin sheet asks for: a step of eight millimetres of a tool of 80 µm has five
// hundred, of some microseconds each. Most of them ask nothing that isn't known. Where nothing is near, the tool goes
// as far at once as there is room. Where something holds it, p̂ goes ahead by many parts at once while the tool hardly
// moves; what makes a part lawful is how far the tool goes in it, seen from all that it may meet, not how far p̂ does.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/near.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// Pairs are gathered as far around as so many parts lead.
constexpr double kGatheredParts = 8.0;
// Of a distance that is known from below this much is used at once: what is left is a tenth of it, for rounding.
constexpr double kOfRoom = 0.9;
// By how much a stride may grow when the one before was short enough, and what is left of it when it wasn't.
constexpr int kLonger = 4;
// A distance is known well enough when its bounds differ by this share, or after so many looks.
constexpr double kKnown = 0.8;
constexpr int kSupports = 24, kNormals = 6;
// A pose with its local problem costs as much as so many pairs.
constexpr int kOfPose = 150;
// Of more points than this a part's box is taken for it.
constexpr std::size_t kManyPoints = 256;

// All points within a radius of the hull of points and rims, or of a box; in a frame that a view leads from.
class Hull {
 public:
  Hull(const Solid* solid, const Bounds& box) noexcept : solid_(solid), box_(&box) {
    if (solid_ != nullptr && solid_->points.size() > kManyPoints && box.finite()) solid_ = nullptr;
    radius_ = solid != nullptr ? solid->radius : 0.0;
  }
  [[nodiscard]] double radius() const noexcept { return radius_; }
  [[nodiscard]] int cost() const noexcept {
    return solid_ == nullptr ? 1 : 1 + static_cast<int>(solid_->points.size() / 8);
  }
  // The furthest along n.
  [[nodiscard]] Vec3 furthest(const Vec3& n) const noexcept {
    if (solid_ == nullptr) return (n.array() < 0.0).select(box_->low, box_->high);
    Vec3 out = Vec3::Zero();
    double most = -std::numeric_limits<double>::infinity();
    const auto take = [&](const Vec3& p) {
      if (const double along = n.dot(p); along > most) {
        most = along;
        out = p;
      }
    };
    for (const Vec3& p : solid_->points) take(p);
    for (const Solid::Rim& rim : solid_->rims) {
      const double u = n.dot(rim.u), v = n.dot(rim.v), size = std::hypot(u, v);
      take(size > 0.0 ? Vec3(rim.centre + rim.radius / size * (u * rim.u + v * rim.v)) : rim.centre);
    }
    return out;
  }

 private:
  const Solid* solid_;
  const Bounds* box_;
  double radius_ = 0.0;
};

// A lower bound of the distance between two hulls: what planes leave between them. Gilbert's algorithm ("An iterative
// procedure for computing the minimum of a quadratic form on a convex set", 1966) turns the plane, from the normal that
// is given.
class BetweenHulls {
 public:
  BetweenHulls(const Hull& own, const View& at, const Hull& other) noexcept : own_(&own), other_(&other), at_(&at) {}

  // By a plane with this normal, out of the object.
  void try_normal(const Vec3& n) noexcept {
    const Vec3 s = nearest(n);
    if (const double gap = n.dot(s); gap > most_) {
      most_ = gap;
      v_ = s;
    }
  }
  double bound() noexcept {
    for (int k = 0; k < kSupports; ++k) {
      const double size = v_.norm();
      if (!(size > 0.0) || most_ >= kKnown * size) break;
      const Vec3 n = v_ / size, s = nearest(n), way = s - v_;
      most_ = std::max(most_, n.dot(s));
      const double length2 = way.squaredNorm();
      if (!(length2 > 0.0)) break;
      v_ += std::clamp(-v_.dot(way) / length2, 0.0, 1.0) * way;
    }
    return most_ - own_->radius() - other_->radius();
  }
  [[nodiscard]] int looks() const noexcept { return looks_; }

 private:
  Vec3 nearest(const Vec3& n) noexcept {
    looks_ += own_->cost() + other_->cost();
    return *at_ * own_->furthest(at_->R.transpose() * -n) - other_->furthest(n);
  }

  const Hull *own_, *other_;
  const View* at_;
  Vec3 v_ = Vec3::Zero();
  double most_ = -std::numeric_limits<double>::infinity();
  int looks_ = 0;
};

}  // namespace

// A lower bound of the distance between a part of the tool and an object.
double RigidWorld::free_m(std::uint16_t part, std::uint16_t entry, const View& at) noexcept {
  const Part& own = shared_->parts[part];
  const Entry& e = shared_->entries[entry];
  double room = std::numeric_limits<double>::infinity();
  bool flat_or_hollow = false;
  with_flat_or_hollow(e.object, [&](const auto& shape) {
    flat_or_hollow = true;
    looks_ -= static_cast<int>(own.solid.points.size());
    for (const Vec3& p : own.solid.points) room = std::min(room, touch(shape, at * p, own.solid.radius).gap);
    for (const Solid::Rim& rim : own.solid.rims) {
      room = std::min(room, touch(shape, at * rim.centre, rim.radius).gap);
    }
  });
  if (flat_or_hollow) return room;
  if (e.object.inside_out) return 0.0;
  const Hull hull(&own.solid, own.box), other(std::get_if<Solid>(&e.object.shape), e.box);
  BetweenHulls between(hull, at, other);
  const Vec3 middle = 0.5 * (e.bounds.low + e.bounds.high);
  const Vec3 away = at * (own.box.finite() ? Vec3(0.5 * (own.box.low + own.box.high)) : Vec3(Vec3::Zero())) - middle;
  if (away.squaredNorm() > 0.0) between.try_normal(away.normalized());
  const Placement* on = moves(entry) ? &moving(entry).mover.at() : nullptr;
  int tried = 0;
  for (std::size_t i = 0; i < found_count_ && tried < kNormals; ++i) {
    const Pair& pair = pairs_[found_[i].pair];
    if (pair.part != part || pair.entry != entry) continue;
    const Vec3& n = found_[i].touch.normal;
    between.try_normal(on == nullptr ? n : Vec3(on->R.transpose() * n));
    ++tried;
  }
  const double bound = between.bound();
  looks_ -= 4 * between.looks();
  return bound;
}

// Of all that may meet the tool. Not more is looked for than `enough`, nor is less told than 0.
double RigidWorld::free_m(const ToolPose& pose, double enough) noexcept {
  const View tool = view(pose);
  double room = enough;
  for (std::size_t i = riding_ == nobody ? 0 : shared_->first_moving; i < shared_->entries.size(); ++i) {
    const auto entry = static_cast<std::uint16_t>(i);
    if (moves(entry) && !moving(entry).close) continue;
    const View at = seen_from(entry, tool);
    for (std::size_t part = 0; part < shared_->parts.size() && room > 0.0; ++part) {
      room = std::min(room, free_m(static_cast<std::uint16_t>(part), entry, at));
    }
  }
  return std::max(room, 0.0);
}

// The tool stands here: the pairs are those that are near, the sides those on which it is.
void RigidWorld::stand(const ToolPose& pose, double far) noexcept {
  if (came_m(pose) > 0.5 * gathered_reach_) {
    gather(pose, gathered_reach_);
    looks_ -= kOfPose + 4 * static_cast<int>(near_faces_);
  }
  set_sides(pose, far);
}

// A step's parts from q_old to p̂, and how far the tool has come.
struct RigidWorld::Strides {
  const ToolPose &p_hat, &q_old;
  double each;  // how far p̂ goes in a part
  int parts;
  int k = 0, stride = 1;  // parts done, and how many the next stride has
  ToolPose reached = q_old;

  [[nodiscard]] double share(int part) const noexcept { return static_cast<double>(part) / parts; }
};

// Where p̂ is then.
ToolPose RigidWorld::way(const Strides& s, int part) const noexcept {
  return part == s.parts ? s.p_hat : on_the_way(s.p_hat, s.q_old, s.share(part));
}

// As many parts as there is room for. Whether there were any.
bool RigidWorld::go_freely(Strides& s) noexcept {
  // What held the tool may have left it off its way. Beyond what is gathered nothing is near, if that is nothing.
  const double off = s.k == 0 ? 0.0 : motion(way(s, s.k), s.reached);
  const int left = s.parts - s.k;
  const double enough = (off + s.each * left) / kOfRoom;
  double room = pair_count_ == 0 ? gathered_reach_ - came_m(s.reached) : 0.0;
  if (room < enough) room = std::max(room, free_m(s.reached, enough));
  const double free = std::floor(std::min((kOfRoom * room - off) / s.each + 1e-9, static_cast<double>(left)));
  if (free < (pair_count_ == 0 ? 1.0 : 2.0) && !(free >= 0.0 && static_cast<int>(free) == left)) return false;
  s.k += static_cast<int>(free);
  let_go(s.share(s.k));
  s.reached = way(s, s.k);
  linear_count_ = found_count_ = 0;
  keep_forces();
  collected_ = false;
  s.stride = 1;
  return true;
}

// A stride in which something holds the tool, or may.
RigidWorld::Strode RigidWorld::go_held(Strides& s) noexcept {
  const int to = std::min(s.k + s.stride, s.parts);
  const ToolPose start = let_go_with(s.reached, s.share(to));
  ToolPose p = way(s, to);
  const double ahead = motion(p, start), most = 2.0 * s.each * s.stride;
  const bool last = to == s.parts && ahead <= most;
  if (ahead > most) p = moved(start, difference(p, start) * (most / ahead));
  share_out(last);
  const int before = budget_;
  ToolPose next = along_with_holder(start);
  const bool solved = settle(p, s.q_old, next);
  looks_ -= kOfPose * (before - budget_);
  const double strode = strode_m(next);
  if (s.stride > 1 && !(solved && strode <= s.each)) {  // too far at once
    overflow_ = false;
    s.stride = std::max(s.stride / (kLonger * kLonger), 1);
    let_go(s.share(s.k));
    return Strode::again;
  }
  s.reached = solved ? next : start;
  if (solved) {
    // As many at once as the tool would need to come as far as it may.
    const double longer = std::min(kOfRoom * s.each / strode, double{kLonger}) * s.stride;
    s.stride = static_cast<int>(std::clamp(longer, 1.0, static_cast<double>(s.parts)));
  } else {
    // Only the last part's forces are asked for. Before it, any pose will do that leads through nothing.
    overflow_ = false;
    if (!give_way(s.reached) || to == s.parts) return Strode::nowhere;
  }
  s.k = to;
  return solved && last ? Strode::to_the_end : Strode::on;
}

bool RigidWorld::in_strides(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, ToolPose& q) noexcept {
  Strides s{p_hat, q_old, far / parts, parts};
  overflow_ = squeezed_ = false;
  let_go(0.0);
  gather(q_old, kGatheredParts * s.each);
  stand(q_old, s.each);
  found_count_ = 0;
  Strode strode = Strode::on;
  while (strode != Strode::to_the_end && strode != Strode::nowhere) {
    if (crowded_) {  // what isn't known may be in the way
      strode = Strode::nowhere;
    } else if (looks_ < 0) {
      wait(s.reached, s.share(s.k), s.each);
      strode = Strode::nowhere;
    } else if (pressed_count_ == 0 && go_freely(s)) {
      strode = s.k == s.parts ? Strode::to_the_end : Strode::on;
    } else {
      strode = go_held(s);
    }
    if (strode == Strode::on) stand(s.reached, s.each);
  }
  q = s.reached;
  return strode == Strode::to_the_end;
}

// Where no more may be looked at, the tool waits where it is, or is taken along, until all has come to where it is at
// the step's end.
void RigidWorld::wait(ToolPose& q, double share, double each) noexcept {
  linear_count_ = found_count_ = 0;
  keep_forces();
  collected_ = false;
  if (riding_ != nobody) {
    q = let_go_with(q, 1.0);
    return;
  }
  double most = 0.0;
  for (const Moving& m : moving_) {
    if (m.close) most = std::max(most, m.mover.way_m(q.position, shared_->reach));
  }
  const int parts = static_cast<int>(std::clamp(std::ceil((1.0 - share) * most / each), 1.0, 8.0 * kMostParts));
  for (int k = 1; k <= parts; ++k) {
    let_go(share + (1.0 - share) * k / parts);
    overflow_ = false;
    if (!give_way(q)) break;
    if (k < parts) stand(q, each);
  }
  let_go(1.0);
}

}  // namespace proxarm::models
