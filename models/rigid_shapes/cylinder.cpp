#include "models/rigid_shapes/cylinder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::models {
namespace {

// A round body that lies on an end or along the side rocks between two places of a rim. So that both places count as
// contacts, the direction from a place of the rim to the body may point into the side or the end by up to this angle
// (rad). Both contacts obey their law at any angle, because no place of a rim may come into the body.
constexpr double kNearlyLevel = 0.05;

Vec3 on(const Solid::Rim& rim, const Vec2& z) noexcept { return z.x() * rim.u + z.y() * rim.v; }

// Finds the largest gap that a plane leaves between a cylinder and points with a radius. The plane with the largest gap
// lies on a face or an end, or between a point and the side or a rim, or along an edge. The caller passes the
// candidates.
class PlanesBetween {
 public:
  PlanesBetween(const Cylinder& cylinder, std::span<const Vec3> points, double radius) noexcept
      : cylinder_(&cylinder), points_(points), radius_(radius) {
    try_both(cylinder.axis);
  }

  void try_along(const Vec3& out) noexcept {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points_) nearest = std::min(nearest, out.dot(p));
    largest_ = std::max(largest_, nearest - radius_ - reach_along(*cylinder_, out));
  }
  void try_both(const Vec3& n) noexcept {
    const double size = n.norm();
    if (!(size > kAlong)) return;
    try_along(n / size);
    try_along(-n / size);
  }
  void try_point(const Vec3& p) noexcept {
    const Vec3 way = p - cylinder_->from, across = way - cylinder_->axis * cylinder_->axis.dot(way);
    if (across.norm() > 0.0) try_along(across.normalized());
    for (const std::uint32_t end : {0U, 1U}) {
      if (const std::optional<Meeting> meeting = meet_rim(*cylinder_, end, p, 0.0)) try_along(meeting->out);
    }
  }
  void try_edge(const Vec3& from, const Vec3& to) noexcept {
    const Vec3 d = (to - from).normalized();
    try_both(cylinder_->axis.cross(d));
    for (const Solid::Rim& rim : cylinder_->rims) {
      std::array<Vec2, 2> places;
      const int count = nearest_to_line(rim, from, d, places);
      for (int k = 0; k < count; ++k) {
        try_both(cylinder_->axis.cross(on(rim, places[static_cast<std::size_t>(k)])).cross(d));
      }
    }
  }

  [[nodiscard]] double largest() const noexcept { return largest_; }

 private:
  const Cylinder* cylinder_;
  std::span<const Vec3> points_;
  double radius_, largest_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

// With P the projection perpendicular to the line, c the vector from y to the rim's centre, and r the rim's radius, the
// squared distance of the place z on the rim from the line is |P c|² + 2 r (P c)ᵀz + r² − r² (dᵀz)². Its negative,
// divided by 2 r, is the function f of circle.hpp plus a constant, if the x axis points along (d_u, d_v).
int nearest_to_line(const Solid::Rim& rim, const Vec3& y, const Vec3& d, std::array<Vec2, 2>& out) noexcept {
  const Vec3 c = rim.centre - y, across = c - d * d.dot(c);
  const Vec2 along(d.dot(rim.u), d.dot(rim.v));
  const double sine = along.norm();
  const Vec2 x_axis = sine > 0.0 ? Vec2(along / sine) : Vec2(Vec2::UnitX()), y_axis(-x_axis.y(), x_axis.x());
  const Vec2 b(-across.dot(rim.u), -across.dot(rim.v));
  // In these axes the quadratic term is one in z_y, because (dᵀz)² = sine² (1 − z_y²).
  const int count = highest_on_circle({x_axis.dot(b), y_axis.dot(b)}, rim.radius * sine * sine, out);
  for (int k = 0; k < count; ++k) {
    Vec2& z = out[static_cast<std::size_t>(k)];
    z = z.x() * x_axis + z.y() * y_axis;
  }
  return count;
}

bool out_of_rim(const Vec3& out, const Vec3& beside, const Vec3& before) noexcept {
  return out.dot(beside) >= -askew_rad && out.dot(before) >= -askew_rad && out.dot(beside + before) > 0.0;
}

double reach_along(const Cylinder& cylinder, const Vec3& n) noexcept {
  const double cosine = cylinder.axis.dot(n), along = std::max(0.0, cosine * cylinder.length);
  return n.dot(cylinder.from) + along + cylinder.radius * cylinder.axis.cross(n).norm();
}

Cylinder cylinder_of(const Solid& solid) noexcept {
  Cylinder out;
  out.rims = {solid.rims[0], solid.rims[1]};
  out.from = out.rims[0].centre;
  out.axis = out.rims[0].u.cross(out.rims[0].v);
  out.length = out.axis.dot(out.rims[1].centre - out.from);
  out.radius = out.rims[0].radius;
  return out;
}

Cylinder moved(const Cylinder& cylinder, const Mat3& R, const Vec3& x) noexcept {
  Cylinder out = cylinder;
  out.from = R * cylinder.from + x;
  out.axis = R * cylinder.axis;
  for (std::size_t k = 0; k < 2; ++k) {
    const Solid::Rim& rim = cylinder.rims[k];
    out.rims[k] = {R * rim.centre + x, R * rim.u, R * rim.v, rim.radius};
  }
  return out;
}

EdgeLine axis_of(const Cylinder& cylinder) noexcept {
  EdgeLine axis;
  axis.from = cylinder.from;
  axis.to = cylinder.from + cylinder.length * cylinder.axis;
  return axis;
}

std::optional<Meeting> meet_side(const Cylinder& cylinder, const Vec3& p, double radius, double beside) noexcept {
  const Vec3 way = p - cylinder.from;
  const double along = cylinder.axis.dot(way);
  if (along < -beside || along > cylinder.length + beside) return {};
  const Vec3 d = way - along * cylinder.axis;
  const double distance = d.norm();
  if (!(distance > 0.0)) return {};
  const Vec3 out = d / distance;
  return Meeting{cylinder.from + along * cylinder.axis + cylinder.radius * out, p - radius * out, out,
                 distance - cylinder.radius - radius};
}

std::optional<Meeting> meet_side(const Cylinder& cylinder, const EdgeLine& edge, double radius,
                                 double beside) noexcept {
  const Vec3 d = edge.to - edge.from, n = cylinder.axis.cross(d), w = edge.from - cylinder.from;
  const double nn = n.squaredNorm(), length = d.norm();
  if (!(nn > 1e-14 * length * length)) return {};
  const double along = w.cross(d).dot(n) / nn, s = w.cross(cylinder.axis).dot(n) / nn;
  if (along < -beside || along > cylinder.length + beside) return {};
  if (s < -beside / length || s > 1.0 + beside / length) return {};
  const std::optional<double> gives_way =
      gives_way_to_ends_m(axis_of(cylinder), edge, cylinder.radius + radius, nn / (length * length));
  if (!gives_way) return {};
  std::optional<Meeting> meeting =
      meet_side(cylinder, edge.from + s * d, radius, std::numeric_limits<double>::infinity());
  if (meeting) meeting->gap += *gives_way;
  return meeting;
}

std::optional<Meeting> meet_end(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius,
                                double beside) noexcept {
  const double height = cylinder.before_end(end, p);
  // The centre of the ball is behind the end's plane: beside the side, or before the other end.
  if (radius > 0.0 && height < -beside) return {};
  const Vec3 out = cylinder.out_of_end(end), foot = p - height * out;
  if ((foot - cylinder.rims[end].centre).norm() > cylinder.radius + beside) return {};
  return Meeting{foot, p - radius * out, out, height - radius};
}

std::optional<Meeting> meet_rim(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius) noexcept {
  const double height = cylinder.before_end(end, p);
  const Vec3 across = p - cylinder.rims[end].centre - height * cylinder.out_of_end(end);
  const double distance = across.norm();
  if (!(height > 0.0 && distance > cylinder.radius)) return {};
  const Vec3 place = cylinder.rims[end].centre + cylinder.radius / distance * across;
  const double gap = (p - place).norm();
  if (!(gap > 0.0)) return {};
  const Vec3 out = (p - place) / gap;
  return Meeting{place, p - radius * out, out, gap - radius};
}

int meet_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, double radius, double beside,
             std::array<Meeting, 2>& out) noexcept {
  const Solid::Rim& rim = cylinder.rims[end];
  const Vec3 way = edge.to - edge.from;
  const double length = way.norm();
  const Vec3 d = way / length;
  std::array<Vec2, 2> places;
  const int count = nearest_to_line(rim, edge.from, d, places);
  int found = 0;
  for (int k = 0; k < count; ++k) {
    const Vec3 arm = on(rim, places[static_cast<std::size_t>(k)]), x = rim.centre + rim.radius * arm;
    const double s = d.dot(x - edge.from);
    if (s < -beside || s > length + beside) continue;
    const Vec3 y = edge.from + s * d, before = cylinder.out_of_end(end);
    Meeting& meeting = out[static_cast<std::size_t>(found)];
    if (radius > 0.0) {
      const double distance = (y - x).norm();
      if (!(distance > 0.0)) continue;
      const Vec3 n = (y - x) / distance;
      if (n.dot(arm) < -kNearlyLevel || n.dot(before) < -kNearlyLevel) continue;
      meeting = {x, y - radius * n, n, distance - radius};
    } else {
      Vec3 n = cylinder.axis.cross(arm).cross(d);
      const double sine = n.norm();
      if (!(sine > kAlong)) continue;
      n *= (n.dot(arm + before) < 0.0 ? -1.0 : 1.0) / sine;
      if (!out_of_rim(n, arm, before)) continue;
      if (!edge.open && !between(-n, edge.left, edge.right)) continue;
      meeting = {x, y, n, n.dot(y - x)};
    }
    ++found;
  }
  return found;
}

double height_of_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, const Vec2& place) noexcept {
  const Solid::Rim& rim = cylinder.rims[end];
  const Vec3 d = (edge.to - edge.from).normalized();
  std::array<Vec2, 2> places;
  const int count = nearest_to_line(rim, edge.from, d, places);
  const Vec2& z = count == 2 && places[1].dot(place) > places[0].dot(place) ? places[1] : places[0];
  const Vec3 arm = on(rim, z), x = rim.centre + rim.radius * arm;
  const Vec3 n = cylinder.axis.cross(arm).cross(d);
  const double sine = n.norm(), sign = n.dot(arm + cylinder.out_of_end(end)) < 0.0 ? -1.0 : 1.0;
  return sine > kAlong ? sign / sine * n.dot(edge.from - x) : std::numeric_limits<double>::quiet_NaN();
}

double extent_along(const Solid& solid, const Vec3& n) noexcept {
  double furthest = -std::numeric_limits<double>::infinity();
  for (const Vec3& p : solid.points) furthest = std::max(furthest, n.dot(p));
  for (const Solid::Rim& rim : solid.rims) {
    furthest = std::max(furthest, n.dot(rim.centre) + rim.radius * std::hypot(n.dot(rim.u), n.dot(rim.v)));
  }
  return furthest + solid.radius;
}

double separation_of_cylinder(const Cylinder& cylinder, const Solid& other) noexcept {
  PlanesBetween planes(cylinder, other.points, other.radius);
  for (const Solid::Face& face : other.faces) planes.try_along(-face.normal);
  for (const Vec3& p : other.points) planes.try_point(p);
  for (const Solid::Edge& edge : other.edges) planes.try_edge(other.points[edge.from], other.points[edge.to]);
  return planes.largest();
}

double separation_of_cylinder(const Cylinder& cylinder, const std::array<Vec3, 3>& triangle) noexcept {
  PlanesBetween planes(cylinder, triangle, 0.0);
  planes.try_both((triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized());
  for (std::size_t k = 0; k < 3; ++k) {
    planes.try_point(triangle[k]);
    planes.try_edge(triangle[k], triangle[(k + 1) % 3]);
  }
  return planes.largest();
}

}  // namespace proxarm::models
