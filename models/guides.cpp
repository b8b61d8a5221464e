#include "models/guides.hpp"

#include <algorithm>
#include <limits>

#include "models/friction_plane.hpp"

namespace proxarm::models {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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
  // (4) on the side on which p is.
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

// Of pieces that are as near as each other (at a corner), the first.
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

// Whether the straight way to a point is free; if not, the point becomes the one where it ends, or `from` itself if
// that is as near as rounding tells.
bool PolylineGuide::leads(const Vec3& from, Vec3& to) noexcept {
  if (!objects_ || from == to) return true;
  const World::Way way = objects_->go_straight(from, to);
  if (!way.stopped) return true;
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  to = (way.end - from).lpNorm<1>() <= 64.0 * u * (from.lpNorm<1>() + 1.0) ? from : way.end;
  contacts_[1] = way.contact;
  count_ = 2;
  return false;
}

Vec3 PolylineGuide::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  count_ = 1;
  std::size_t i = nearest_piece(q);
  const Piece& first = pieces_[i];
  const double s_q = std::clamp(first.e.dot(q - first.a), first.begin, first.length);
  const Vec3 q_on = first.a + s_q * first.e;
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  // A proxy on the guide within rounding (as FlatSurface::rounding) sticks bit for bit.
  const bool on = (q - q_on).lpNorm<1>() <= 16.0 * u * (q.lpNorm<1>() + first.a.lpNorm<1>() + std::abs(s_q));

  // Where (4) would take it along this piece, and to which side.
  const auto slide = [&](const Piece& piece, double from, double& to) {
    const Vec3 d = p - piece.a;
    const double s_p = piece.e.dot(d), reach = mu_ * (d - s_p * piece.e).norm();
    if (std::abs(s_p - from) <= reach) {
      to = from;
      return 0;
    }
    to = s_p - std::copysign(reach, s_p - from);
    return s_p > from ? 1 : -1;
  };
  double s = s_q, to = s_q;
  int direction = slide(first, s_q, to);
  const bool corner = pieces_.size() > 1 && (s_q <= 0.0 || s_q >= first.length);
  if (direction == 0 && !corner) return report(on ? q : q_on, p, i, false);
  Vec3 here = on ? q : q_on;
  for (std::size_t visited = 0; visited <= 2 * pieces_.size(); ++visited) {
    const Piece& piece = pieces_[i];
    if (to >= piece.begin && to <= piece.length && direction != 0) {
      Vec3 r = piece.a + to * piece.e;
      const bool free = leads(here, r);
      return report(r, p, i, free && mu_ > 0.0);
    }
    // The end of the piece (or it doesn't move on it): does the next one lead on?
    const bool forward = direction > 0 || (direction == 0 && s >= piece.length);
    const double end = forward ? piece.length : piece.begin;
    const bool at_end = direction != 0 || s == end;
    const bool last_piece = forward ? i + 1 == pieces_.size() : i == 0;
    const Vec3 corner_point = piece.a + end * piece.e;
    if (!at_end) return report(on ? q : q_on, p, i, false);
    const bool moved = (corner_point - q_on).squaredNorm() > 0.0;
    Vec3 held = moved ? corner_point : (on ? q : q_on);
    if (!leads(here, held)) return report(held, p, i, false);
    here = held;
    if (last_piece && !closed_) return report(held, p, i, false);
    const std::size_t next = forward ? (i + 1) % pieces_.size() : (i + pieces_.size() - 1) % pieces_.size();
    const double enter = forward ? 0.0 : pieces_[next].length;
    double on_next = enter;
    const int next_direction = slide(pieces_[next], enter, on_next);
    if (next_direction != (forward ? 1 : -1)) return report(held, p, i, false);  // held in the corner
    i = next;
    s = enter;
    to = on_next;
    direction = next_direction;
  }
  return report(on ? q : q_on, p, i, false);
}

}  // namespace proxarm::models
