#include "scenes/section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "models/box_obstacle.hpp"
#include "models/description/setup_error.hpp"
#include "models/mesh_obstacle.hpp"
#include "models/plane_obstacle.hpp"
#include "models/round_obstacle.hpp"

namespace proxarm::scenes {
namespace {

using models::Pose;
using models::Vec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
// Of a direction that is given in round numbers; a space's own axes are held to as much.
constexpr double straight = 1e-6;

// Along a line, from a to b.
struct Interval {
  double a = -infinity, b = infinity;
  [[nodiscard]] bool empty() const noexcept { return !(a < b); }
  void meet(double low, double high) noexcept {
    a = std::max(a, low);
    b = std::min(b, high);
  }
};

// Where |u + t d| ≤ half.
Interval within_slab(double u, double d, double half) {
  if (d == 0.0) return std::abs(u) <= half ? Interval{} : Interval{0.0, 0.0};
  const double s = -(u + half) / d, t = (half - u) / d;
  return {std::min(s, t), std::max(s, t)};
}

// Where ‖u + t d‖ ≤ R.
Interval within_radius(const Vec3& u, const Vec3& d, double R) {
  const double a = d.squaredNorm();
  if (!(a > 1e-24)) return u.norm() <= R ? Interval{} : Interval{0.0, 0.0};
  const double middle = -u.dot(d) / a, away = (u + middle * d).norm();
  if (!(away < R)) return {0.0, 0.0};
  const double half = std::sqrt((R - away) * (R + away) / a);
  return {middle - half, middle + half};
}

class Section {
 public:
  Section(const Scene& scene, const Object& object)
      : scene_(scene), object_(object), mu_(scene.space.dimensions > 1 ? object.friction : 0.0) {}

  std::vector<Part> operator()(const PlaneShape& /*shape*/) const { return {}; }  // compile.cpp cuts it itself
  std::vector<Part> operator()(const SphereShape& s) const {
    return (*this)(CapsuleShape{s.centre_m, s.centre_m, s.radius_m, s.inside_out});
  }

  std::vector<Part> operator()(const BoxShape& s) const {
    const models::Mat3& R = s.pose_W.linear();
    const Vec3 centre = s.pose_W.translation(), half = 0.5 * s.size_m;
    if (line()) {
      Interval held;
      const Vec3 u = R.transpose() * (origin() - centre), d = R.transpose() * axis(0);
      for (int k = 0; k < 3; ++k) {
        const Interval slab = within_slab(u[k], d[k], half[k]);
        held.meet(slab.a, slab.b);
      }
      return interval(held, s.inside_out);
    }
    for (int k = 0; k < 3; ++k) {
      if (!(R.col(k).cross(axis(2)).norm() < straight)) continue;
      if (!(std::abs(axis(2).dot(centre - origin())) < half[k])) return outside(s.inside_out);
      return rectangle(centre, R.col((k + 1) % 3), half[(k + 1) % 3], half[(k + 2) % 3], s.inside_out);
    }
    throw askew();
  }

  std::vector<Part> operator()(const CylinderShape& s) const {
    const Vec3 middle = 0.5 * (s.from_m + s.to_m), e = (s.to_m - s.from_m).normalized();
    const double half = 0.5 * (s.to_m - s.from_m).norm();
    if (line()) {
      const Vec3 u = origin() - middle, d = axis(0);
      Interval held = within_radius(u - e * e.dot(u), d - e * e.dot(d), s.radius_m);
      const Interval slab = within_slab(e.dot(u), e.dot(d), half);
      held.meet(slab.a, slab.b);
      return interval(held, s.inside_out);
    }
    const double height = axis(2).dot(middle - origin());
    if (e.cross(axis(2)).norm() < straight) {
      return std::abs(height) < half ? disc(middle, s.radius_m, s.inside_out) : outside(s.inside_out);
    }
    if (!(std::abs(e.dot(axis(2))) < straight)) throw askew();
    if (!(std::abs(height) < s.radius_m)) return outside(s.inside_out);
    return rectangle(middle, e, half, std::sqrt((s.radius_m - height) * (s.radius_m + height)), s.inside_out);
  }

  std::vector<Part> operator()(const CapsuleShape& s) const {
    const models::SegmentCore core(s.from_m, s.to_m);
    if (line()) {
      // Convex: from the least to the greatest of what its middle and its ends hold.
      const Vec3 u = origin() - s.from_m, d = axis(0);
      Interval held = within_radius(u - core.e * core.e.dot(u), d - core.e * core.e.dot(d), s.radius_m);
      const Interval slab = within_slab(core.e.dot(u) - 0.5 * core.end, core.e.dot(d), 0.5 * core.end);
      held.meet(slab.a, slab.b);
      for (const Vec3& end : {s.from_m, s.to_m}) {
        const Interval ball = within_radius(origin() - end, d, s.radius_m);
        if (ball.empty()) continue;
        held = held.empty() ? ball : Interval{std::min(held.a, ball.a), std::max(held.b, ball.b)};
      }
      return interval(held, s.inside_out);
    }
    const double from = axis(2).dot(s.from_m - origin()), to = axis(2).dot(s.to_m - origin());
    const bool across = core.end == 0.0 || core.e.cross(axis(2)).norm() < straight;
    if (!across && !(std::abs(core.e.dot(axis(2))) < straight)) throw askew();
    const double away = from * to < 0.0 ? 0.0 : std::min(std::abs(from), std::abs(to));
    if (!(away < s.radius_m)) return outside(s.inside_out);
    const double radius = std::sqrt((s.radius_m - away) * (s.radius_m + away));
    if (across) return disc(s.from_m, radius, s.inside_out);
    return one(std::make_unique<models::Capsule>(models::SegmentCore(in_space(s.from_m), in_space(s.to_m)), radius, mu_,
                                                 s.inside_out));
  }

  std::vector<Part> operator()(const MeshShape& s) const {
    if (!object_.friction_regions.empty()) {
      throw error("found friction_regions of " + object_.name, "give the mesh one friction there");
    }
    models::TriangleSoup walls;
    const double deep = 2.0 * (s.mesh->bounds().high - s.mesh->bounds().low).norm();
    for (std::uint32_t face = 0; face < s.mesh->size(); ++face) {
      std::array<Vec3, 3> x;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 d = s.mesh->corner(face, k) - origin();
        x[k] = {axis(0).dot(d), axis(1).dot(d), axis(2).dot(d)};
      }
      line() ? add_point(x, deep, walls) : add_segment(x, deep, walls);
    }
    if (walls.triangles.empty()) return outside(s.inside_out);
    return one(
        std::make_unique<models::MeshObstacle>(std::make_shared<const models::TriangleMesh>(std::move(walls)), mu_));
  }

 private:
  [[nodiscard]] bool line() const noexcept { return scene_.space.dimensions == 1; }
  [[nodiscard]] const Vec3& origin() const noexcept { return scene_.space.origin_m; }
  [[nodiscard]] Vec3 axis(Eigen::Index k) const noexcept { return scene_.space.axes.col(k); }
  // The nearest point of the space, in its coordinates.
  [[nodiscard]] Vec3 in_space(const Vec3& x_W) const noexcept {
    Vec3 x = scene_.space.axes.transpose() * (x_W - origin());
    for (int k = scene_.space.dimensions; k < 3; ++k) x[k] = 0.0;
    return x;
  }

  static std::vector<Part> one(std::unique_ptr<models::Obstacle> obstacle) {
    std::vector<Part> parts;
    parts.push_back({std::move(obstacle), -1});
    return parts;
  }

  [[nodiscard]] description::SetupError error(std::string message, std::string advice) const {
    return description::SetupError({.file = scene_.file.string(),
                                    .line = object_.line,
                                    .message = std::move(message) + " in a scene of " +
                                               std::to_string(scene_.space.dimensions) +
                                               (line() ? " dimension" : " dimensions"),
                                    .advice = std::move(advice)});
  }
  [[nodiscard]] description::SetupError askew() const {
    return error("found " + object_.name + " (" + kind_of(object_.shape) + "), which the space cuts askew,",
                 "turn one of its axes into the space or across it, or use "
                 "`dimensions: 3`");
  }

  // The space doesn't meet the solid.
  [[nodiscard]] std::vector<Part> outside(bool inside_out) const {
    if (inside_out && object_.shape.index() != 5) {
      throw error("the proxy's space lies inside the object " + object_.name, "move `space` or the object");
    }
    return {};
  }

  [[nodiscard]] std::vector<Part> disc(const Vec3& centre_W, double radius, bool inside_out) const {
    return one(std::make_unique<models::Sphere>(models::PointCore{in_space(centre_W)}, radius, mu_, inside_out));
  }

  [[nodiscard]] std::vector<Part> interval(const Interval& held, bool inside_out) const {
    if (held.empty() || !std::isfinite(held.b - held.a)) return outside(inside_out);
    return block(Vec3(0.5 * (held.a + held.b), 0.0, 0.0), models::Mat3::Identity(), {0.5 * (held.b - held.a)},
                 inside_out);
  }

  [[nodiscard]] std::vector<Part> rectangle(const Vec3& centre_W, const Vec3& e_W, double along, double across,
                                            bool inside_out) const {
    Vec3 e = scene_.space.axes.transpose() * e_W;
    e.z() = 0.0;
    e.normalize();
    models::Mat3 R;
    R << e.x(), -e.y(), 0.0, e.y(), e.x(), 0.0, 0.0, 0.0, 1.0;
    return block(in_space(centre_W), R, {along, across}, inside_out);
  }

  // So deep across the space that no way leaves or enters there.
  [[nodiscard]] std::vector<Part> block(const Vec3& centre, const models::Mat3& R, const std::vector<double>& half,
                                        bool inside_out) const {
    Pose pose = Pose::Identity();
    pose.linear() = R;
    pose.translation() = centre;
    const double deep = 10.0 * *std::max_element(half.begin(), half.end());
    Vec3 size = Vec3::Constant(2.0 * deep);
    for (std::size_t k = 0; k < half.size(); ++k) size[static_cast<Eigen::Index>(k)] = 2.0 * half[k];
    if (!inside_out) return one(std::make_unique<models::BoxObstacle>(pose, size, mu_));
    std::vector<Part> parts;
    for (const auto& face : models::BoxObstacle::faces(pose, size)) {
      if (parts.size() == 2 * half.size()) break;
      parts.push_back({std::make_unique<models::PlaneObstacle>(face.point(), Vec3(-face.normal()), mu_),
                       static_cast<std::int32_t>(parts.size())});
    }
    return parts;
  }

  // An upright rectangle over the segment from a to b.
  static void add_wall(const Vec3& a, const Vec3& b, const Vec3& up, models::TriangleSoup& walls) {
    if (a == b) return;
    const auto first = static_cast<std::uint32_t>(walls.vertices.size());
    for (const Vec3& x : {Vec3(a - up), Vec3(b - up), Vec3(b + up), Vec3(a + up)}) walls.vertices.push_back(x);
    walls.triangles.push_back({first, first + 1, first + 2});
    walls.triangles.push_back({first, first + 2, first + 3});
  }

  // Where z = 0 cuts the triangle. A corner at z = 0 counts as above; where a side is cut doesn't depend on which of
  // its triangles is asked, so that walls meet.
  static void add_segment(const std::array<Vec3, 3>& x, double deep, models::TriangleSoup& walls) {
    std::array<Vec3, 2> ends;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = x[k], &b = x[(k + 1) % 3];
      if ((a.z() < 0.0) == (b.z() < 0.0)) continue;
      const Vec3 &low = a.z() < 0.0 ? a : b, &high = a.z() < 0.0 ? b : a;
      ends[count] = low + low.z() / (low.z() - high.z()) * (high - low);
      ends[count++].z() = 0.0;
    }
    if (count == 2) add_wall(ends[0], ends[1], Vec3(0, 0, deep), walls);
  }

  // Where the x axis passes the triangle.
  static void add_point(const std::array<Vec3, 3>& x, double deep, models::TriangleSoup& walls) {
    const auto area = [](const Vec3& a, const Vec3& b) { return a.y() * b.z() - a.z() * b.y(); };
    const std::array<double, 3> w{area(x[1], x[2]), area(x[2], x[0]), area(x[0], x[1])};
    const double sum = w[0] + w[1] + w[2];
    const auto [least, greatest] = std::minmax_element(w.begin(), w.end());
    if (sum == 0.0 || (*least < 0.0 && *greatest > 0.0)) return;
    const double at = (w[0] * x[0].x() + w[1] * x[1].x() + w[2] * x[2].x()) / sum;
    add_wall({at, -deep, 0}, {at, deep, 0}, Vec3(0, 0, deep), walls);
  }

  const Scene& scene_;
  const Object& object_;
  double mu_;
};

}  // namespace

std::vector<Part> section_of(const Scene& scene, const Object& object) {
  return std::visit(Section(scene, object), object.shape);
}

}  // namespace proxarm::scenes
