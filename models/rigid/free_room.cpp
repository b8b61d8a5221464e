#include "models/rigid/free_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "models/rigid_features/near.hpp"

namespace proxarm::models {
namespace {

// The search for a distance ends when the lower bound is at least this share of the upper bound, or after this many
// evaluations of support points.
constexpr double kKnown = 0.8;
constexpr int kSupports = 24, kNormals = 6;
// A solid with more points than this is replaced by its box.
constexpr std::size_t kManyPoints = 256;

// The convex hull of a solid's points and rims; if the solid has many points, the hull of its box. The solid's radius
// is around the hull.
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
  // Returns the point of the hull that is furthest along n.
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

// Computes a lower bound of the distance between two hulls: the gap between the hulls along a normal. Starting from the
// best normal that was tried, Gilbert's algorithm improves the normal ("An iterative procedure for computing the
// minimum of a quadratic form on a convex set", 1966).
class BetweenHulls {
 public:
  BetweenHulls(const Hull& own, const View& at, const Hull& other) noexcept : own_(&own), other_(&other), at_(&at) {}

  // Tries a normal. It points out of the object.
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

// Returns the gap between a part of the tool and a flat or hollow object, m; nullopt if the object has another shape.
std::optional<double> room_in_field(const Solid& own, const RigidEntry& entry, const View& at,
                                    int& looks_left) noexcept {
  std::optional<double> room;
  with_flat_or_hollow(entry.object, [&](const auto& shape) {
    room = std::numeric_limits<double>::infinity();
    looks_left -= static_cast<int>(own.points.size());
    for (const Vec3& p : own.points) room = std::min(*room, touch(shape, at * p, own.radius).gap);
    for (const Solid::Rim& rim : own.rims) room = std::min(*room, touch(shape, at * rim.centre, rim.radius).gap);
  });
  return room;
}

double room_between(const RigidState& state, std::uint16_t part, std::uint16_t entry, const View& at,
                    int& looks_left) noexcept {
  const RigidPart& own = state.bodies.setup().parts[part];
  const RigidEntry& e = state.bodies.setup().entries[entry];
  if (const std::optional<double> room = room_in_field(own.solid, e, at, looks_left)) return *room;
  if (e.object.inside_out) return 0.0;
  const Hull hull(&own.solid, own.box), other(e.solid(), e.box);
  BetweenHulls between(hull, at, other);
  const Vec3 middle = 0.5 * (e.bounds.low + e.bounds.high);
  const Vec3 away = at * (own.box.finite() ? Vec3(0.5 * (own.box.low + own.box.high)) : Vec3(Vec3::Zero())) - middle;
  if (away.squaredNorm() > 0.0) between.try_normal(away.normalized());
  int tried = 0;
  for (const Found& found : state.touches.all()) {
    if (tried == kNormals) break;
    const Pair& pair = state.candidates.pairs[found.pair];
    if (pair.part != part || pair.entry != entry) continue;
    between.try_normal(state.bodies.direction_in_object(entry, found.touch.normal));
    ++tried;
  }
  const double bound = between.bound();
  looks_left -= 4 * between.looks();
  return bound;
}

}  // namespace

double free_room_m(const RigidState& state, const ToolPose& pose, double enough_m, int& looks_left) noexcept {
  const RigidBodies& bodies = state.bodies;
  const RigidSetup& setup = bodies.setup();
  const View tool = view(pose);
  double room = enough_m;
  for (std::size_t i = bodies.has_carrier() ? setup.first_moving : 0; i < setup.entries.size(); ++i) {
    const auto entry = static_cast<std::uint16_t>(i);
    if (bodies.moves(entry) && !bodies.moving(entry).close) continue;
    const View at = bodies.seen_from(entry, tool);
    for (std::size_t part = 0; part < setup.parts.size() && room > 0.0; ++part) {
      room = std::min(room, room_between(state, static_cast<std::uint16_t>(part), entry, at, looks_left));
    }
  }
  return std::max(room, 0.0);
}

}  // namespace proxarm::models
