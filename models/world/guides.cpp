#include "models/world/guides.hpp"

#include <algorithm>
#include <limits>

#include "models/obstacles/sweep.hpp"
#include "models/surfaces/friction_plane.hpp"

namespace proxarm::models {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
// The longest push of the proxy along the guide, as a multiple of the object's motion at q. A push is this motion
// divided by the sine of the angle between the object's surface and the guide. So ten allows angles down to about 6°;
// at smaller angles the object would throw the proxy far along the guide.
constexpr double longest_push = 10.0;

// Whether a proxy that the object has carried to `carried` may end at x, and x is outside the object.
bool is_clear(const Obstacle& object, const Vec3& carried, const Vec3& x) noexcept {
  return !object.excludes(carried, x) && object.distance(x) >= 0.0;
}

void check_friction(double friction) {
  if (!std::isfinite(friction) || !(friction >= 0.0)) {
    throw std::invalid_argument("a friction coefficient must be finite and not negative");
  }
}

}  // namespace

PlaneGuide::PlaneGuide(const Vec3& point_m, const Vec3& normal, double friction)
    : surface_(point_m, normal), mu_(friction) {
  check_friction(friction);
}

Vec3 PlaneGuide::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  // Applies (4) to the half-space that p is behind, because the plane holds the proxy from both sides.
  const bool above = surface_.height(p) > 0.0;
  const FlatSurface<3> side = above ? FlatSurface<3>::of_unit(surface_.point(), Vec3(-surface_.normal())) : surface_;
  const FaceStep<3> s = step_on_face(side, mu_, p, q);
  contact_.normal = side.normal();
  contact_.slips = s.slips;
  return s.r;
}

PolylineGuide::PolylineGuide(const std::vector<Vec3>& points_m, bool closed, double friction)
    : closed_(closed), mu_(friction) {
  check_friction(friction);
  if (points_m.size() < 2) throw std::invalid_argument("a polyline needs two points or more");
  const std::size_t pieces = points_m.size() - (closed ? 0 : 1);
  for (std::size_t i = 0; i < pieces; ++i) {
    const Vec3 &a = points_m[i], &b = points_m[(i + 1) % points_m.size()];
    if (!a.allFinite() || !b.allFinite()) throw std::invalid_argument("a polyline needs finite points");
    pieces_.push_back({a, unit<3>(b - a), (b - a).norm(), 0.0});
  }
}

PolylineGuide PolylineGuide::line(const Vec3& point_m, const Vec3& direction, double friction) {
  check_friction(friction);
  PolylineGuide guide;
  guide.mu_ = friction;
  guide.pieces_.push_back({point_m, unit<3>(direction), infinity, -infinity});
  return guide;
}

// Returns the piece nearest to q. If several pieces are equally near (at a corner), returns the first of them.
std::size_t PolylineGuide::nearest_piece(const Vec3& q) const noexcept {
  std::size_t best = 0;
  double least = infinity;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Piece& piece = pieces_[i];
    const double s = std::clamp(piece.e.dot(q - piece.a), piece.begin, piece.length);
    const double distance = (q - piece.a - s * piece.e).squaredNorm();
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

Vec3 PolylineGuide::report(const Vec3& r, const Vec3& p, std::size_t piece, bool slips) noexcept {
  last_ = piece;
  const Vec3 f = r - p;
  const double size = f.norm();
  contacts_[0].normal = size > 0.0 ? Vec3(f / size) : pieces_[piece].e.unitOrthogonal();
  contacts_[0].feature = static_cast<std::int32_t>(piece);
  contacts_[0].slips = slips;
  return r;
}

// Whether the straight path from `from` to `to` is free. If it isn't, `to` becomes the point where an object stops the
// proxy, or `from` if the two points are equal within rounding. With `past_pushing`, objects that push in this step
// don't count.
bool PolylineGuide::leads(const Vec3& from, Vec3& to, bool past_pushing) noexcept {
  if (from == to) return true;
  bool free = true;
  Vec3 end = to;
  if (objects_) {
    const World::Sweep swept = objects_->sweep(from, to);
    if (swept.stopped) {
      free = false;
      end = swept.end;
      contacts_[1] = swept.contact;
    }
  }
  for (std::size_t i = 0; movers_ && i < movers_->size(); ++i) {
    const World::Entry& mover = (*movers_)[i];
    if ((past_pushing && pushes_[i] != 0) || !mover.obstacle->bars(from, end)) continue;
    free = false;
    end = models::sweep(*mover.obstacle, from, end);
    // Takes the contact from a step that leads a nanometre into the object.
    const Vec3 back = (from - to).normalized();
    const Obstacle::Step s = mover.obstacle->step(1.0, end - 1e-9 * back, end);
    contacts_[1] = {mover.object, mover.feature < 0 ? s.feature : mover.feature, false, s.touches ? s.normal : back};
  }
  if (free) return true;
  to = (end - from).lpNorm<1>() <= 64.0 * u * (from.lpNorm<1>() + 1.0) ? from : end;
  count_ = 2;
  return false;
}

void PolylineGuide::set_time(const StepTime& time) noexcept {
  if (!movers_) return;
  for (const World::Entry& mover : *movers_) mover.obstacle->set_time(time.time_s, time.period_s);
}

// Changes `piece` to its neighbour. Returns false at an end of the guide.
bool PolylineGuide::next_piece(std::size_t& piece, bool forward) const noexcept {
  if (!closed_ && (forward ? piece + 1 == pieces_.size() : piece == 0)) return false;
  piece = forward ? (piece + 1) % pieces_.size() : (piece + pieces_.size() - 1) % pieces_.size();
  return true;
}

// Returns the place at the distance `by` (m, signed) from `at` along the guide, or the end of the guide if that is
// nearer.
PolylineGuide::Place PolylineGuide::advance(Place at, double by) const noexcept {
  const bool forward = by > 0.0;
  for (std::size_t visited = 0; visited <= pieces_.size(); ++visited) {
    const Piece& piece = pieces_[at.piece];
    const double end = forward ? piece.length : piece.begin, left = std::abs(end - at.s);
    if (std::abs(by) <= left) {
      at.s += by;
      break;
    }
    by -= std::copysign(left, by);
    at.s = end;
    std::size_t next = at.piece;
    if (!next_piece(next, forward)) break;
    at.piece = next;
    at.s = forward ? pieces_[next].begin : pieces_[next].length;
  }
  at.x = pieces_[at.piece].a + at.s * pieces_[at.piece].e;
  return at;
}

// Moves `place`, which the object covers, to the next free place on one side: doubles the step until a place is free,
// then bisects. Returns false if no place within `most` (m) is free.
bool PolylineGuide::clear_of(const Obstacle& object, const Vec3& carried, int side, double most,
                             Place& place) const noexcept {
  if (!(most > 0.0)) return false;
  double held = 0.0, free = most / 1024.0;
  Place end = advance(place, side * free);
  while (!is_clear(object, carried, end.x)) {
    if (!(free < most)) return false;
    held = free;
    free = std::min(2.0 * free, most);
    end = advance(place, side * free);
  }
  const double least = u * (place.x.lpNorm<1>() + most);
  while (free - held > least) {
    const double middle = 0.5 * (held + free);
    if (middle == held || middle == free) break;
    const Place between = advance(place, side * middle);
    if (is_clear(object, carried, between.x)) {
      free = middle;
      end = between;
    } else {
      held = middle;
    }
  }
  place = end;
  return true;
}

// Returns the direction along the piece in which an object that covers q pushes: 1, −1, or 0 if the object pushes
// across the piece. Fills in `contact`.
int PolylineGuide::pushed_to(const Obstacle& object, const Vec3& carried, const Vec3& q, std::size_t piece,
                             Contact<3>& contact) const noexcept {
  const Obstacle::Step s = object.step(1.0, q, q);
  contact.normal = s.touches ? s.normal : Vec3((carried - q).normalized());
  contact.feature = s.feature;
  contact.slips = false;
  const double lean = contact.normal.dot(pieces_[piece].e);
  return lean > 0.0 ? 1 : lean < 0.0 ? -1 : 0;
}

// Whether no object blocks the path along the guide from `from` to `to`. Objects that push in this step don't count.
bool PolylineGuide::reaches(Place from, const Place& to, int side) noexcept {
  for (std::size_t visited = 0; visited <= pieces_.size() && from.piece != to.piece; ++visited) {
    const Piece& piece = pieces_[from.piece];
    Vec3 corner = piece.a + (side > 0 ? piece.length : piece.begin) * piece.e;
    if (!leads(from.x, corner, true)) return false;
    from.x = corner;
    if (!next_piece(from.piece, side > 0)) return false;
  }
  Vec3 end = to.x;
  return leads(from.x, end, true);
}

// Moves `place`, the place of q, along with the objects that cover it. Returns false if the objects leave no room: the
// proxy is then squeezed, and `place` doesn't change.
bool PolylineGuide::carry(const Vec3& q, Place& place) noexcept {
  if (!movers_) return true;
  const Place begin = place;
  int side = 0;
  bool fits = true, any = false;
  for (std::size_t i = 0; i < movers_->size(); ++i) {
    const Obstacle& object = *(*movers_)[i].obstacle;
    const Vec3 carried = object.carry(q);
    pushes_[i] = object.excludes(carried, begin.x) ? 1 : 0;
    if (pushes_[i] == 0) continue;
    any = true;
    contacts_[1].object = (*movers_)[i].object;
    const int pushed = pushed_to(object, carried, q, begin.piece, contacts_[1]);
    if ((*movers_)[i].feature >= 0) contacts_[1].feature = (*movers_)[i].feature;
    count_ = 2;
    fits = fits && pushed != 0 && (side == 0 || pushed == side);
    side = pushed;
    const double most = longest_push * (carried - q).norm();
    // Another object may already have pushed `place` far enough.
    if (!fits || is_clear(object, carried, place.x)) continue;
    Place pushed_place = begin;
    fits = clear_of(object, carried, side, most, pushed_place);
    if (fits && (pushed_place.x - begin.x).squaredNorm() > (place.x - begin.x).squaredNorm()) place = pushed_place;
  }
  if (!any) return true;
  const Contact<3> pusher = contacts_[1];
  if (fits && reaches(begin, place, side)) {
    contacts_[1] = pusher;
    return true;
  }
  place = begin;
  return false;
}

Vec3 PolylineGuide::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  count_ = 1;
  squeezed_ = false;
  Place place{nearest_piece(q), 0.0, q};
  const Piece& nearest = pieces_[place.piece];
  place.s = std::clamp(nearest.e.dot(q - nearest.a), nearest.begin, nearest.length);
  const Vec3 foot = nearest.a + place.s * nearest.e;
  // A proxy that is on the guide within rounding (as in FlatSurface::rounding) and sticks is returned bit for bit.
  if (!((q - foot).lpNorm<1>() <= 16.0 * u * (q.lpNorm<1>() + nearest.a.lpNorm<1>() + std::abs(place.s)))) {
    place.x = foot;
  }
  if (!carry(q, place)) {
    squeezed_ = true;
    ++unresolved_;
    return report(place.x, p, place.piece, false);
  }
  const bool pushed = count_ == 2;
  const Contact<3> pusher = contacts_[1];
  count_ = 1;
  const Vec3 r = slide(p, place);
  if (pushed && count_ == 1 && r == place.x) {
    contacts_[1] = pusher;
    count_ = 2;
  }
  return r;
}

// Returns where (4) takes a proxy along a piece. `from`: the proxy's position along the piece, m.
PolylineGuide::Lead PolylineGuide::lead(const Piece& piece, const Vec3& p, double from) const noexcept {
  const Vec3 d = p - piece.a;
  const double s_p = piece.e.dot(d), reach = mu_ * (d - s_p * piece.e).norm();
  if (std::abs(s_p - from) <= reach) return {from, 0};
  return {s_p - std::copysign(reach, s_p - from), s_p > from ? 1 : -1};
}

// Makes the step by (4) from `place`. The proxy goes around a corner if the next piece leads it on in the same
// direction.
Vec3 PolylineGuide::slide(const Vec3& p, const Place& place) noexcept {
  std::size_t i = place.piece;
  const double begin = pieces_[i].begin, length = pieces_[i].length;
  Lead way = lead(pieces_[i], p, place.s);
  if (way.side == 0) {
    // This piece doesn't lead the proxy away. If the proxy is in a corner, the neighbouring piece may lead it away.
    const bool in_corner = pieces_.size() > 1 && (place.s == begin || place.s == length);
    if (!in_corner) return report(place.x, p, i, false);
    way = place.s == length ? Lead{infinity, 1} : Lead{-infinity, -1};
  }
  Vec3 here = place.x;
  for (std::size_t visited = 0; visited <= 2 * pieces_.size(); ++visited) {
    const Piece& piece = pieces_[i];
    if (way.to >= piece.begin && way.to <= piece.length) {
      Vec3 r = piece.a + way.to * piece.e;
      const bool free = leads(here, r);
      return report(r, p, i, free && mu_ > 0.0);
    }
    const bool forward = way.side > 0;
    const double end = forward ? piece.length : piece.begin;
    Vec3 corner = place.piece == i && place.s == end ? place.x : Vec3(piece.a + end * piece.e);
    if (!leads(here, corner)) return report(corner, p, i, false);
    here = corner;
    std::size_t next = i;
    if (!next_piece(next, forward)) return report(corner, p, i, false);
    const Lead on = lead(pieces_[next], p, forward ? pieces_[next].begin : pieces_[next].length);
    // The next piece doesn't lead the proxy on in this direction, so the corner holds the proxy.
    if (on.side != way.side) return report(corner, p, i, false);
    i = next;
    way = on;
  }
  return report(place.x, p, i, false);
}

}  // namespace proxarm::models
