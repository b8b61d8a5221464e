#include "scenes/compiler/section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"

namespace proxarm::scenes {
namespace {

using models::Pose;
using models::Vec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
// Up to this angle (rad), two directions count as parallel or perpendicular. The axes of a space must be perpendicular
// to the same accuracy. Users write up to six digits; a larger tolerance would hide errors that can be felt.
constexpr double straight = 1e-6;

// Up to this distance from the space (metres), a point of a guide counts as lying in the space. The accuracy of an arm
// is of about the same size.
constexpr double beside_m = 1e-6;

std::string in_dimensions(const Scene& scene) {
  return " in a scene of " + (scene.space.dimensions == 1 ? std::string("1 dimension")
                                                          : std::to_string(scene.space.dimensions) + " dimensions");
}

// Returns the point of the space that is nearest to x_W, in coordinates of the space.
Vec3 nearest_in(const Space& space, const Vec3& x_W) noexcept {
  Vec3 x = space.axes.transpose() * (x_W - space.origin_m);
  for (int k = space.dimensions; k < 3; ++k) x[k] = 0.0;
  return x;
}

// Returns the part of a vector along the space, in coordinates of the space. `rest` becomes the length of the part
// perpendicular to the space.
Vec3 along(const Space& space, const Vec3& v_W, double& rest) noexcept {
  Vec3 v = space.axes.transpose() * v_W;
  double out = 0.0;
  for (int k = space.dimensions; k < 3; ++k) {
    out = std::hypot(out, v[k]);
    v[k] = 0.0;
  }
  rest = out;
  return v;
}

// An interval from a to b along a line.
struct Interval {
  double a = -infinity, b = infinity;
  [[nodiscard]] bool empty() const noexcept { return !(a < b); }
  void meet(double low, double high) noexcept {
    a = std::max(a, low);
    b = std::min(b, high);
  }
};

// Returns the interval of t in which |u + t d| ≤ half.
Interval within_slab(double u, double d, double half) {
  if (d == 0.0) return std::abs(u) <= half ? Interval{} : Interval{0.0, 0.0};
  const double s = -(u + half) / d, t = (half - u) / d;
  return {std::min(s, t), std::max(s, t)};
}

// Returns the interval of t in which ‖u + t d‖ ≤ R.
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

  std::vector<Part> operator()(const PlaneShape& s) const {
    const auto plane = plane_in_space(scene_, object_, s);
    if (!plane) return {};
    return one(std::make_unique<models::PlaneObstacle>(plane->point_m, plane->normal, mu_, layer_on(infinity)));
  }
  std::vector<Part> operator()(const SphereShape& s) const {
    return (*this)(CapsuleShape{s.centre_m, s.centre_m, s.radius_m, s.inside_out});
  }

  std::vector<Part> operator()(const BoxShape& s) const {
    if (s.inside_out) return room(s);
    const models::Mat3& R = s.pose_W.linear();
    const Vec3 centre = s.pose_W.translation(), half = 0.5 * s.size_m;
    if (line()) {
      Interval held;
      const Vec3 u = R.transpose() * (origin() - centre), d = R.transpose() * axis(0);
      for (int k = 0; k < 3; ++k) {
        const Interval slab = within_slab(u[k], d[k], half[k]);
        held.meet(slab.a, slab.b);
      }
      return interval(held, false);
    }
    for (int k = 0; k < 3; ++k) {
      if (!(R.col(k).cross(axis(2)).norm() < straight)) continue;
      if (!(std::abs(axis(2).dot(centre - origin())) < half[k])) return {};
      return rectangle(centre, R.col((k + 1) % 3), half[(k + 1) % 3], half[(k + 2) % 3], false);
    }
    return polygon(s);
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
      // A capsule is convex. So its interval reaches from the smallest to the largest t of its cylinder and of its two
      // balls.
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
                                                 s.inside_out, layer_on(s.inside_out ? infinity : 2.0 * radius)));
  }

  std::vector<Part> operator()(const MeshShape& s) const {
    const std::vector<double> friction = friction_by_face(scene_, object_);
    models::TriangleSoup walls;
    FrictionOfWalls of_walls;
    const double deep = 2.0 * (s.mesh->bounds().high - s.mesh->bounds().low).norm();
    for (std::uint32_t face = 0; face < s.mesh->size(); ++face) {
      std::array<Vec3, 3> x;
      for (std::size_t k = 0; k < 3; ++k) x[k] = coordinates(s.mesh->corner(face, k));
      const std::size_t before = walls.vertices.size();
      line() ? add_point(x, deep, walls) : add_segment(x, deep, walls);
      if (friction.empty() || walls.vertices.size() == before) continue;
      of_walls[ends_of(walls.vertices[before], walls.vertices[before + 1])] = friction[face];
    }
    if (walls.triangles.empty()) return {};
    return standing(std::move(walls), of_walls);
  }

 private:
  [[nodiscard]] bool line() const noexcept { return scene_.space.dimensions == 1; }
  [[nodiscard]] const Vec3& origin() const noexcept { return scene_.space.origin_m; }
  [[nodiscard]] Vec3 axis(Eigen::Index k) const noexcept { return scene_.space.axes.col(k); }
  // Returns the coordinates of a point of W, including those perpendicular to the space.
  [[nodiscard]] Vec3 coordinates(const Vec3& x_W) const noexcept {
    const Vec3 d = x_W - origin();
    return {axis(0).dot(d), axis(1).dot(d), axis(2).dot(d)};
  }
  [[nodiscard]] Vec3 in_space(const Vec3& x_W) const noexcept { return nearest_in(scene_.space, x_W); }

  static std::vector<Part> one(std::unique_ptr<models::Obstacle> obstacle) {
    std::vector<Part> parts;
    parts.push_back({std::move(obstacle), -1});
    return parts;
  }

  [[nodiscard]] description::SetupError error(std::string message, std::string advice) const {
    return refusal(scene_, object_.line, std::move(message) + in_dimensions(scene_), std::move(advice));
  }
  [[nodiscard]] description::SetupError askew() const {
    return error("found " + object_.name + " (" + kind_of(object_.shape) + "), which the space cuts askew,",
                 "turn one of its axes into the space or across it, or use `dimensions: 3` with `guide: plane`");
  }

  // Returns the object's layer on a section of this thickness; 0 means that the section can't have a layer.
  [[nodiscard]] models::Layer layer_on(double thickness_m) const {
    return scenes::layer_on(
        scene_, object_, thickness_m,
        thickness_m > 0.0
            ? "less than half of how thick its section is, " + description::number_text(thickness_m) + " m"
            : "a layer on what is no mesh and, if it is solid, has its axes in the space or across it");
  }

  // Returns the section by a space that doesn't meet the solid, which is empty. Throws SetupError for a cavity, because
  // the proxy would have no free place.
  [[nodiscard]] std::vector<Part> outside(bool inside_out) const {
    if (inside_out)
      throw error("the proxy's space lies inside the object " + object_.name, "move `space` or the object");
    return {};
  }

  [[nodiscard]] std::vector<Part> disc(const Vec3& centre_W, double radius, bool inside_out) const {
    return one(std::make_unique<models::Sphere>(models::PointCore{in_space(centre_W)}, radius, mu_, inside_out,
                                                layer_on(inside_out ? infinity : 2.0 * radius)));
  }

  [[nodiscard]] std::vector<Part> interval(const Interval& held, bool inside_out) const {
    if (held.empty() || !std::isfinite(held.b - held.a)) return outside(inside_out);
    const double half = 0.5 * (held.b - held.a);
    return block(Vec3(0.5 * (held.a + held.b), 0.0, 0.0), models::Mat3::Identity(), {half}, inside_out);
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

  // Returns a box that is so deep perpendicular to the space that the proxy meets only its sides.
  [[nodiscard]] std::vector<Part> block(const Vec3& centre, const models::Mat3& R, const std::vector<double>& half,
                                        bool inside_out) const {
    Pose pose = Pose::Identity();
    pose.linear() = R;
    pose.translation() = centre;
    const double deep = 10.0 * *std::max_element(half.begin(), half.end());
    Vec3 size = Vec3::Constant(2.0 * deep);
    for (std::size_t k = 0; k < half.size(); ++k) size[static_cast<Eigen::Index>(k)] = 2.0 * half[k];
    const double thickness = 2.0 * *std::min_element(half.begin(), half.end());
    if (!inside_out) return one(std::make_unique<models::BoxObstacle>(pose, size, mu_, layer_on(thickness)));
    std::vector<Part> parts;
    for (const auto& face : models::BoxObstacle::faces(pose, size)) {
      if (parts.size() == 2 * half.size()) break;
      parts.push_back(
          {std::make_unique<models::PlaneObstacle>(face.point(), Vec3(-face.normal()), mu_, layer_on(infinity)),
           static_cast<std::int32_t>(parts.size())});
    }
    return parts;
  }

  // Returns those faces of a box seen from inside that meet the space.
  [[nodiscard]] std::vector<Part> room(const BoxShape& s) const {
    std::vector<Part> parts;
    std::int32_t feature = 0;
    for (const auto& face : models::BoxObstacle::faces(s.pose_W, s.size_m)) {
      const auto plane = plane_in_space(scene_, object_, {face.point(), Vec3(-face.normal())});
      if (plane)
        parts.push_back(
            {std::make_unique<models::PlaneObstacle>(plane->point_m, plane->normal, mu_, layer_on(infinity)), feature});
      ++feature;
    }
    return parts;
  }

  // Returns an oblique section of a box: walls on three to six segments.
  [[nodiscard]] std::vector<Part> polygon(const BoxShape& s) const {
    models::TriangleSoup walls;
    const auto corner = [&](int axis, double first, double second, double third) {
      Vec3 sign;
      sign[axis] = first;
      sign[(axis + 1) % 3] = second;
      sign[(axis + 2) % 3] = third;
      return coordinates(s.pose_W * Vec3(0.5 * s.size_m.cwiseProduct(sign)));
    };
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        const std::array<Vec3, 4> face{corner(axis, side, -1, -1), corner(axis, side, 1, -1), corner(axis, side, 1, 1),
                                       corner(axis, side, -1, 1)};
        add_segment(face, 2.0 * s.size_m.norm(), walls);
      }
    }
    if (walls.triangles.empty()) return {};
    return standing(std::move(walls), {});
  }

  // Friction of each wall. The key is the ends of the wall's segment, the smaller end first.
  using FrictionOfWalls = std::map<std::array<double, 4>, double>;
  static std::array<double, 4> ends_of(const Vec3& a, const Vec3& b) {
    const bool in_order = a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
    const Vec3 &first = in_order ? a : b, &second = in_order ? b : a;
    return {first.x(), first.y(), second.x(), second.y()};
  }

  [[nodiscard]] std::vector<Part> standing(models::TriangleSoup walls, const FrictionOfWalls& friction) const {
    static_cast<void>(layer_on(0.0));
    const auto mesh = std::make_shared<const models::TriangleMesh>(std::move(walls));
    std::vector<double> by_face;
    for (std::uint32_t face = 0; face < mesh->size() && !friction.empty() && !line(); ++face) {
      // Two corners of the triangle are at the same end of the segment, one above the other. The third corner is at the
      // other end.
      const Vec3 &a = mesh->corner(face, 0), &b = mesh->corner(face, 1), &c = mesh->corner(face, 2);
      by_face.push_back(friction.at(ends_of(a, a.head<2>() == b.head<2>() ? c : b)));
    }
    return one(std::make_unique<models::MeshObstacle>(mesh, mu_, std::move(by_face)));
  }

  // Adds a rectangular wall on the segment from a to b.
  static void add_wall(const Vec3& a, const Vec3& b, const Vec3& up, models::TriangleSoup& walls) {
    if (a == b) return;
    const auto first = static_cast<std::uint32_t>(walls.vertices.size());
    for (const Vec3& x : {Vec3(a - up), Vec3(b - up), Vec3(b + up), Vec3(a + up)}) walls.vertices.push_back(x);
    walls.triangles.push_back({first, first + 1, first + 2});
    walls.triangles.push_back({first, first + 2, first + 3});
  }

  // Adds the segment in which the plane z = 0 cuts a triangle or a rectangle. A corner at z = 0 counts as above the
  // plane. The two faces at an edge give the same cut point, so neighbouring walls meet exactly.
  static void add_segment(std::span<const Vec3> x, double deep, models::TriangleSoup& walls) {
    std::array<Vec3, 2> ends;
    std::size_t count = 0;
    for (std::size_t k = 0; k < x.size() && count < 2; ++k) {
      const Vec3 &a = x[k], &b = x[(k + 1) % x.size()];
      if ((a.z() < 0.0) == (b.z() < 0.0)) continue;
      const Vec3 &low = a.z() < 0.0 ? a : b, &high = a.z() < 0.0 ? b : a;
      ends[count] = low + low.z() / (low.z() - high.z()) * (high - low);
      ends[count++].z() = 0.0;
    }
    if (count == 2) add_wall(ends[0], ends[1], Vec3(0, 0, deep), walls);
  }

  // Adds the point at which the x axis passes through the triangle, found by barycentric coordinates.
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

bool leads_out(double rest, const Vec3& v) { return rest > straight * v.norm(); }

}  // namespace

std::vector<Part> section_of(const Scene& scene, const Object& object) {
  return std::visit(Section(scene, object), object.shape);
}

// In coordinates ξ of the space, the half-space is n_Wᵀ(origin + A ξ − point_W) ≥ 0, so its normal is Aᵀn_W.
std::optional<PlaneShape> plane_in_space(const Scene& scene, const Object& object, const PlaneShape& plane) {
  const Space& space = scene.space;
  const Vec3 n = plane.normal.normalized(), near = nearest_in(space, plane.point_m);
  double rest = 0.0;
  const Vec3 m = along(space, n, rest);
  const double height = n.dot(space.origin_m + space.axes * near - plane.point_m);
  // A space that is parallel to the plane, within rounding, either doesn't meet the plane or lies in it.
  if (m.norm() < 1e-12) {
    if (!(height < 0.0)) return std::nullopt;
    throw refusal(scene, object.line, "the proxy's space lies inside the object " + object.name,
                  "move `space` or the object");
  }
  return PlaneShape{near - m * (height / m.squaredNorm()), m};
}

models::ScriptedMotion script_in_space(const Scene& scene, const Object& object) {
  models::ScriptedMotion script = script_of(*object.motion);
  const Space& space = scene.space;
  if (space.dimensions == 3) return script;
  double out_v = 0.0, out_a = 0.0, out_axis = 0.0;
  const Vec3 v = along(space, script.velocity_m_per_s, out_v), a = along(space, script.amplitude_m, out_a);
  Vec3 axis = space.axes.transpose() * script.axis;
  out_axis = space.dimensions == 1 ? 1.0 : axis.head<2>().norm();
  const bool turns = script.turn_rad_per_s != 0.0;
  if (leads_out(out_v, script.velocity_m_per_s) || leads_out(out_a, script.amplitude_m) ||
      (turns && out_axis > straight)) {
    throw refusal(scene, object.line,
                  "found " + object.name + ", whose motion leads out of the proxy's space," + in_dimensions(scene),
                  space.dimensions == 1 ? "let it move along the line, or use `dimensions: 3` with `guide: line`"
                                        : "let it move within the plane and turn about an axis across it, or use "
                                          "`dimensions: 3` with `guide: plane`");
  }
  script.velocity_m_per_s = v;
  script.amplitude_m = a;
  script.axis = std::copysign(1.0, axis.z()) * Vec3::UnitZ();
  script.centre_m = nearest_in(space, script.centre_m);
  if (!turns) script.centre_m.setZero();
  return script;
}

Pose pose_in_space(const Space& space, const Pose& X_W) noexcept {
  if (space.dimensions == 3) return X_W;
  Pose X = Pose::Identity();
  const Vec3 moved = X_W.linear() * space.origin_m + X_W.translation() - space.origin_m;
  double rest = 0.0;
  X.translation() = along(space, X_W.linear().isIdentity(0.0) ? Vec3(X_W.translation()) : moved, rest);
  if (space.dimensions == 1 || X_W.linear().isIdentity(0.0)) return X;
  const models::Mat3 R = space.axes.transpose() * X_W.linear() * space.axes;
  const double c = R(0, 0) + R(1, 1), s = R(1, 0) - R(0, 1), length = std::hypot(c, s);
  if (!(length > 0.0)) return X;
  X.linear().topLeftCorner<2, 2>() << c / length, -s / length, s / length, c / length;
  return X;
}

GuideDescription guide_in_space(const Scene& scene) {
  using Kind = GuideDescription::Kind;
  GuideDescription guide = *scene.guide;
  const Space& space = scene.space;
  if (space.dimensions == 3) return guide;
  const auto refuse = [&](const std::string& what, std::string advice) -> description::SetupError {
    return refusal(scene, guide.line_number, "found a guide" + what + in_dimensions(scene), std::move(advice));
  };
  if (space.dimensions == 1) throw refuse("", "leave it out: the line that the proxy lives on guides it");
  if (guide.kind == Kind::plane) {
    double rest = 0.0;
    const Vec3 n = guide.direction.normalized(), m = along(space, n, rest);
    const Vec3 near = nearest_in(space, guide.points_m.front());
    if (m.norm() < straight) throw refuse(" on a plane along the proxy's own", "leave it out, or use `dimensions: 3`");
    const double height = n.dot(space.origin_m + space.axes * near - guide.points_m.front());
    guide.points_m = {near - m * (height / m.squaredNorm())};
    guide.direction = Vec3(-m.y(), m.x(), 0.0);
    guide.kind = Kind::line;
    return guide;
  }
  const auto leads_off = [&] {
    return refuse(" that leads out of the proxy's plane", "move it into `space`, or use `dimensions: 3`");
  };
  for (Vec3& point : guide.points_m) {
    if (!(std::abs(space.axes.col(2).dot(point - space.origin_m)) <= beside_m)) throw leads_off();
    point = nearest_in(space, point);
  }
  const std::size_t count = guide.points_m.size();
  for (std::size_t i = guide.closed ? 0 : 1; i < count; ++i) {
    if (guide.points_m[i] == guide.points_m[(i + count - 1) % count]) throw leads_off();
  }
  double rest = 0.0;
  const Vec3 direction = along(space, guide.direction, rest);
  if (guide.kind == Kind::line) {
    if (leads_out(rest, guide.direction)) throw leads_off();
    guide.direction = direction;
  }
  return guide;
}

}  // namespace proxarm::scenes
