#include "models/rigid_shapes/touch.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

// A rim is level if its lowest point is below its centre by less than this. It is a tenth of the gap tolerance
// (kGap_m).
constexpr double kLevel_m = 1e-13;
// If a rim is tilted by at most this angle (rad), four points of it are held instead of only the lowest.
constexpr double kNearlyLevel = 0.05;

// Returns the tangent plane of a hollow sphere at the point nearest to p, as a flat side.
FlatSide side_of(const HollowSphere& hollow, const Vec3& p) noexcept {
  const Vec3 out = p - hollow.centre;
  const double distance = out.norm();
  const Vec3 n = distance > 0.0 ? Vec3(-out / distance) : Vec3(Vec3::UnitZ());
  return {n, n.dot(hollow.centre) - hollow.radius};
}

// If the sag of a crossing is at most this, the crossing doesn't count. It is a quarter of the gap tolerance (kGap_m).
constexpr double kSag_m = 2.5e-13;
// From a sag of kSag_m up to this many times kSag_m, a crossing gives way to the ends gradually. With a sudden change,
// a tool would go to and fro between the crossing and the ends.
constexpr double kSagFades = 10.0;
// Largest sine² of the angle between two edges at which a crossing may give way to the ends.
constexpr double kMaySag = 1e-4;

double in_unit(double s) noexcept { return std::clamp(s, 0.0, 1.0); }

struct Crossing {
  Vec3 own = Vec3::Zero(), other = Vec3::Zero();
  Vec3 across = Vec3::Zero();  // direction of `own` × direction of `other`, not normalised
};

// Returns the nearest points of two lines; nullopt if one of the points lies beyond its segment by more than `beside`.
std::optional<Crossing> cross(const EdgeLine& own, const EdgeLine& other, double beside) noexcept {
  const Vec3 a = own.to - own.from, b = other.to - other.from, d = other.from - own.from;
  const Vec3 n = a.cross(b);
  const double aa = a.squaredNorm(), bb = b.squaredNorm(), nn = n.squaredNorm();
  // The edges are parallel within 1e-7 rad: their ends, together with faces, determine the contact.
  if (nn <= 1e-14 * aa * bb) return {};
  const double s = d.cross(b).dot(n) / nn, t = d.cross(a).dot(n) / nn;
  const double slack_s = beside / std::sqrt(aa), slack_t = beside / std::sqrt(bb);
  if (s < -slack_s || s > 1.0 + slack_s || t < -slack_t || t > 1.0 + slack_t) return {};
  return Crossing{own.from + s * a, other.from + t * b, n};
}

}  // namespace

bool between(const Vec3& n, const Vec3& left, const Vec3& right) noexcept {
  const Vec3 w = left.cross(right);
  const double size = w.norm();
  if (size < 1e-9) return n.dot(left) > 1.0 - askew_rad;
  return left.cross(n).dot(w) >= -askew_rad * size && n.cross(right).dot(w) >= -askew_rad * size &&
         n.dot(left + right) > 0.0;
}

Touch touch(const FlatSide& side, const Vec3& p, double radius) noexcept {
  return {p - radius * side.normal, side.normal, side.normal.dot(p) - side.offset - radius};
}

Touch touch(const HollowSphere& hollow, const Vec3& p, double radius) noexcept {
  const Vec3 out = p - hollow.centre;
  const double distance = out.norm();
  const Vec3 n = distance > 0.0 ? Vec3(-out / distance) : Vec3(Vec3::UnitZ());
  return {p - radius * n, n, hollow.radius - distance - radius};
}

Touch touch(const HollowTube& hollow, const Vec3& p, double radius) noexcept {
  const Vec3 along = hollow.to - hollow.from;
  const double s = along.dot(p - hollow.from) / along.squaredNorm();
  const Vec3 out = p - (hollow.from + (hollow.endless ? s : in_unit(s)) * along);
  const double distance = out.norm();
  const Vec3 n = distance > 0.0 ? Vec3(-out / distance) : along.unitOrthogonal();
  return {p - radius * n, n, hollow.radius - distance - radius};
}

Vec2 lowest_of_rim(const FlatSide& side, const Solid::Rim& rim) noexcept {
  const Vec2 down(-side.normal.dot(rim.u), -side.normal.dot(rim.v));
  const double tilt = down.norm();
  return rim.radius * tilt > kLevel_m ? Vec2(down / tilt) : Vec2(Vec2::Zero());
}

int nearest_of_rim(const FlatSide& side, const Solid::Rim& rim, const Vec2& level, std::array<Vec3, 4>& out) noexcept {
  const double tilt = std::hypot(side.normal.dot(rim.u), side.normal.dot(rim.v));
  const Vec2 lowest = lowest_of_rim(side, rim), z = lowest.isZero(0.0) ? level : lowest;
  const Vec3 low = z.x() * rim.u + z.y() * rim.v;
  out[0] = rim.centre + rim.radius * low;
  if (tilt > kNearlyLevel) return 1;
  const Vec3 beside = rim.u.cross(rim.v).cross(low);
  out[1] = rim.centre + rim.radius * beside;
  out[2] = rim.centre - rim.radius * beside;
  out[3] = rim.centre - rim.radius * low;
  return 4;
}

int nearest_of_rim(const HollowSphere& hollow, const Solid::Rim& rim, const Vec2& level,
                   std::array<Vec3, 4>& out) noexcept {
  return nearest_of_rim(side_of(hollow, rim.centre), rim, level, out);
}

// With P the projection perpendicular to the axis a, c the vector from the axis to the rim's centre, r the rim's radius
// and z the place on the rim in u and v, the squared distance from the axis is |P c|² + 2 r (c_u, c_v)ᵀz + r² − r²
// ((a_u, a_v)ᵀz)², where c_u and c_v are the components of P c. Divided by 2 r, this is the function f of circle.hpp
// plus a constant, if the y axis points along (a_u, a_v).
int nearest_of_rim(const HollowTube& hollow, const Solid::Rim& rim, const Vec2& /*level*/,
                   std::array<Vec3, 4>& out) noexcept {
  const Vec3 a = (hollow.to - hollow.from).normalized(), c = rim.centre - hollow.from, across = c - a * a.dot(c);
  const Vec2 tilt(a.dot(rim.u), a.dot(rim.v));
  const double sine = tilt.norm();
  const Vec2 y = sine > 0.0 ? Vec2(tilt / sine) : Vec2(Vec2::UnitY()), x(y.y(), -y.x());
  const Vec2 b(across.dot(rim.u), across.dot(rim.v));
  std::array<Vec2, 2> places;
  const int count = highest_on_circle({x.dot(b), y.dot(b)}, rim.radius * sine * sine, places);
  for (int k = 0; k < count; ++k) {
    const Vec2 z = places[static_cast<std::size_t>(k)].x() * x + places[static_cast<std::size_t>(k)].y() * y;
    out[static_cast<std::size_t>(k)] = rim.centre + rim.radius * (z.x() * rim.u + z.y() * rim.v);
  }
  return count;
}

std::optional<Touch> touch_face(const Vec3& p, double radius, const Vec3& normal, double offset,
                                std::span<const Vec3> points, std::span<const std::uint32_t> ring, double side,
                                double beside) noexcept {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec3& corner = points[ring[k]];
    const Vec3 inwards = normal.cross(points[ring[k + 1 < ring.size() ? k + 1 : 0]] - corner);
    const double height = inwards.dot(p - corner);
    if (height < 0.0 && height * height > beside * beside * inwards.squaredNorm()) return {};
  }
  const Vec3 n = side * normal;
  return Touch{p - radius * n, n, side * (normal.dot(p) - offset) - radius};
}

std::optional<Touch> touch_point(const Vec3& own, const Vec3& other, double radii) noexcept {
  const Vec3 d = own - other;
  const double distance = d.norm();
  if (!(distance > 0.0)) return {};
  return Touch{own, d / distance, distance - radii};
}

std::optional<Touch> touch_round(const Vec3& p, const EdgeLine& edge, double radii, double own_radius,
                                 bool own_is_edge) noexcept {
  const Vec3 along = edge.to - edge.from;
  const double s = along.dot(p - edge.from) / along.squaredNorm();
  if (!(s > 0.0 && s < 1.0)) return {};
  const Vec3 foot = edge.from + s * along;
  std::optional<Touch> t = own_is_edge ? touch_point(foot, p, radii) : touch_point(p, foot, radii);
  if (t) t->point -= own_radius * t->normal;
  return t;
}

std::optional<double> gives_way_to_ends_m(const EdgeLine& one, const EdgeLine& other, double radii,
                                          double sine2) noexcept {
  if (sine2 > kMaySag) return 0.0;
  const double length = (one.to - one.from).norm();
  const Vec3 along = (one.to - one.from) / length;
  const double from = along.dot(other.from - one.from), to = along.dot(other.to - one.from);
  const double both = std::min(std::max(from, to), length) - std::max(std::min(from, to), 0.0);
  const double sag = both > 0.0 ? sine2 * both * both / (8.0 * radii) : 0.0;
  if (sag <= kSag_m) return {};
  return kSag_m * std::max(0.0, (kSagFades - sag / kSag_m) / (kSagFades - 1.0));
}

std::optional<Touch> touch_edges_round(const EdgeLine& own, const EdgeLine& other, double radii,
                                       double own_radius) noexcept {
  const std::optional<Crossing> x = cross(own, other, beside_m);
  if (!x) return {};
  const double lengths2 = (own.to - own.from).squaredNorm() * (other.to - other.from).squaredNorm();
  const std::optional<double> gives_way = gives_way_to_ends_m(own, other, radii, x->across.squaredNorm() / lengths2);
  if (!gives_way) return {};
  std::optional<Touch> t = touch_point(x->own, x->other, radii);
  if (!t) return {};
  t->point -= own_radius * t->normal;
  t->gap += *gives_way;
  return t;
}

std::optional<Touch> touch_edges_sharp(const EdgeLine& own, const EdgeLine& other, double orientation,
                                       double beside) noexcept {
  const std::optional<Crossing> x = cross(own, other, beside);
  if (!x) return {};
  const Vec3 n = orientation * x->across.normalized();
  if (!other.open && !between(n, other.left, other.right)) return {};
  if (!own.open && !between(-n, own.left, own.right)) return {};
  return Touch{x->own, n, n.dot(x->own - x->other)};
}

}  // namespace proxarm::models
