#include "models/rigid_shapes/solid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <stdexcept>
#include <variant>

#include "models/rigid_shapes/exact_hull.hpp"

namespace proxarm::models {
namespace {

void require(bool fine, const char* what) {
  if (!fine) throw std::invalid_argument(what);
}

Solid::Around around(const Solid& solid, std::span<const std::uint32_t> points) {
  Solid::Around out;
  out.low = out.high = solid.points[points.front()];
  for (const std::uint32_t i : points) {
    out.low = out.low.cwiseMin(solid.points[i]);
    out.high = out.high.cwiseMax(solid.points[i]);
  }
  return out;
}

Solid finished(Solid solid) {
  solid.reach = 0.0;
  for (const Vec3& p : solid.points) solid.reach = std::max(solid.reach, p.norm() + solid.radius);
  for (const Solid::Rim& rim : solid.rims) solid.reach = std::max(solid.reach, rim.centre.norm() + rim.radius);
  solid.cones = normal_cones(solid.points.size(), [&](auto visit) {
    for (const Solid::Face& face : solid.faces) visit(face.normal, solid.corners(face));
  });
  for (const Solid::Edge& edge : solid.edges) solid.cones.of_edges.push_back(cone_of_edge(edge.left, edge.right));
  for (const Solid::Edge& edge : solid.edges) {
    const std::array<std::uint32_t, 2> ends{edge.from, edge.to};
    solid.around_edges.push_back(around(solid, ends));
  }
  for (const Solid::Face& face : solid.faces) solid.around_faces.push_back(around(solid, solid.corners(face)));
  return solid;
}

// Computes the hull by gift wrapping: from each face, it goes over the face's edges to the neighbouring faces, until
// each edge has two faces.
class Hull {
 public:
  explicit Hull(std::vector<Vec3> points) : points_(std::move(points)) {
    Vec3 low = points_.front(), high = low;
    for (const Vec3& p : points_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    // Points that are at most this far from a face's plane are corners of the face; it is about a million roundings. In
    // files of seven digits, points of a flat side may be further from the plane than this, but nearer than what
    // distinguishes one face from the next. Such points are left to ExactHull.
    flat_ = 1e-10 * (high - low).norm();
    middle_ = Vec3::Zero();
    for (const Vec3& p : points_) middle_ += p / static_cast<double>(points_.size());
  }

  Solid build() {
    add_face(first_plane());
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      require(faces_.size() < 4 * points_.size() + 8, "the points span no solid");
      const std::vector<std::uint32_t> ring = rings_[i];
      for (std::size_t k = 0; k < ring.size(); ++k) {
        wrap_over(ring[k], ring[(k + 1) % ring.size()], faces_[i].normal);
      }
    }
    return collected();
  }

 private:
  // Returns the normal of a supporting plane. It is found by tilting an axis-parallel plane onto the points twice.
  Vec3 first_plane() {
    const auto lowest = static_cast<std::uint32_t>(
        std::min_element(points_.begin(), points_.end(), [](const Vec3& a, const Vec3& b) { return a.x() < b.x(); }) -
        points_.begin());
    const Vec3 start = -Vec3::UnitX();
    const Vec3 n1 = tilted(lowest, Vec3::UnitY(), start);
    std::uint32_t second = lowest;
    for (std::uint32_t j = 0; j < points_.size(); ++j) {
      const Vec3 d = points_[j] - points_[lowest];
      if (std::abs(n1.dot(d)) <= flat_ && d.norm() > (points_[second] - points_[lowest]).norm()) second = j;
    }
    require(second != lowest, "the points span no solid");
    return tilted(lowest, (points_[second] - points_[lowest]).normalized(), n1);
  }

  // Turns the plane through the point `at` with normal n about an axis in the plane, until the plane meets the next
  // points. Returns the new normal.
  Vec3 tilted(std::uint32_t at, const Vec3& axis, const Vec3& n) const {
    // Direction in the plane, perpendicular to the axis; on this side of the axis the plane turns towards the points.
    const Vec3 away = n.cross(axis);
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points_) {
      const Vec3 d = p - points_[at];
      const Vec3 across = d - axis * axis.dot(d);
      if (across.norm() <= flat_) continue;
      double angle = std::atan2(-n.dot(d), away.dot(d));
      if (angle < -1e-9) angle += 2.0 * std::numbers::pi;
      least = std::min(least, std::max(angle, 0.0));
    }
    require(least < std::numbers::pi - 1e-9, "the points span no solid");
    return (std::cos(least) * n + std::sin(least) * away).normalized();
  }

  void wrap_over(std::uint32_t from, std::uint32_t to, const Vec3& n) {
    for (const Solid::Edge& edge : edges_) {
      if ((edge.from == from && edge.to == to) || (edge.from == to && edge.to == from)) return;
    }
    // Seen along the edge, this face lies to the left. `away` points to the far side of the edge, where the next face
    // begins.
    const Vec3 axis = (points_[from] - points_[to]).normalized();
    const Vec3 away = n.cross(axis);
    double most = -std::numeric_limits<double>::infinity();
    Vec3 next = n;
    for (const Vec3& p : points_) {
      const Vec3 d = p - points_[from], across = d - axis * axis.dot(d);
      if (across.norm() <= flat_ || std::abs(n.dot(d)) <= flat_) continue;
      // The plane of the next face has all points behind it. So it goes through the point that is seen at the flattest
      // angle beyond the edge.
      const double angle = std::atan2(n.dot(d), away.dot(d));
      const double turned = angle <= -std::numbers::pi + 1e-12 ? std::numbers::pi : angle;
      if (turned > most) {
        most = turned;
        const Vec3 unit = across.normalized();
        next = axis.cross(unit);
        if (next.dot(middle_ - points_[from]) > 0.0) next = -next;
      }
    }
    edges_.push_back({from, to, n, add_face(next.normalized())});
  }

  // Returns the exact normal of the face whose normal is about `normal`. Adds the face if it is new.
  Vec3 add_face(const Vec3& normal) {
    for (const Solid::Face& face : faces_) {
      if ((face.normal - normal).norm() < 1e-7) return face.normal;
    }
    double top = -std::numeric_limits<double>::infinity();
    for (const Vec3& p : points_) top = std::max(top, normal.dot(p));
    std::vector<std::uint32_t> on;
    for (std::uint32_t j = 0; j < points_.size(); ++j) {
      if (normal.dot(points_[j]) >= top - 2.0 * flat_) on.push_back(j);
    }
    require(on.size() >= 3, "the points span no solid");
    const std::vector<std::uint32_t> ring = outline(on, normal);
    require(ring.size() >= 3, "the points span no solid");
    Vec3 exact = Vec3::Zero();
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
      exact += (points_[ring[k]] - points_[ring[0]]).cross(points_[ring[k + 1]] - points_[ring[0]]);
    }
    exact.normalize();
    double offset = -std::numeric_limits<double>::infinity();
    for (const std::uint32_t j : ring) offset = std::max(offset, exact.dot(points_[j]));
    faces_.push_back({exact, offset, 0, static_cast<std::uint32_t>(ring.size())});
    rings_.push_back(ring);
    return exact;
  }

  // Returns the convex outline of points in a plane (Andrew's monotone chain), counter-clockwise about the normal.
  std::vector<std::uint32_t> outline(std::vector<std::uint32_t> on, const Vec3& normal) const {
    const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
    const auto at = [&](std::uint32_t j) { return Eigen::Vector2d(u.dot(points_[j]), v.dot(points_[j])); };
    std::sort(on.begin(), on.end(), [&](std::uint32_t a, std::uint32_t b) {
      const Eigen::Vector2d x = at(a), y = at(b);
      return x.x() < y.x() || (x.x() == y.x() && x.y() < y.y());
    });
    std::vector<std::uint32_t> chain;
    for (int side = 0; side < 2; ++side) {
      const std::size_t begin = chain.size();
      for (const std::uint32_t j : on) {
        while (chain.size() >= begin + 2) {
          const Eigen::Vector2d a = at(chain[chain.size() - 2]), b = at(chain.back()), c = at(j);
          const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
          if (area > flat_ * (c - a).norm()) break;
          chain.pop_back();
        }
        chain.push_back(j);
      }
      chain.pop_back();
      std::reverse(on.begin(), on.end());
    }
    return chain;
  }

  Solid collected() const {
    Solid solid;
    std::vector<std::uint32_t> number(points_.size(), ~0U);
    const auto point = [&](std::uint32_t j) {
      if (number[j] == ~0U) {
        number[j] = static_cast<std::uint32_t>(solid.points.size());
        solid.points.push_back(points_[j]);
      }
      return number[j];
    };
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      Solid::Face face = faces_[i];
      face.first = static_cast<std::uint32_t>(solid.ring.size());
      for (const std::uint32_t j : rings_[i]) solid.ring.push_back(point(j));
      solid.faces.push_back(face);
    }
    for (Solid::Edge edge : edges_) {
      edge.from = point(edge.from);
      edge.to = point(edge.to);
      solid.edges.push_back(edge);
    }
    require(solid.points.size() + solid.faces.size() == solid.edges.size() + 2, "the points span no solid");  // Euler
    return solid;
  }

  std::vector<Vec3> points_;
  double flat_ = 0.0;
  Vec3 middle_;
  std::vector<Solid::Face> faces_;
  std::vector<std::vector<std::uint32_t>> rings_;
  std::vector<Solid::Edge> edges_;
};

// If a body is thinner than this share of its size, it isn't a solid: its points lie in one plane, except for rounding.
constexpr double kThin = 1e-9;
// If a face is narrower than this share of the body's size, it has no normal of its own: its corners lie on a line,
// except for rounding.
constexpr double kNeedle = 1e-12;

// Builds a solid from points of which some lie nearly in one plane, but too far from it to count as corners of one
// face.
class ExactHull {
 public:
  explicit ExactHull(std::vector<Vec3> points) : points_(std::move(points)) {
    const auto before = [](const Vec3& a, const Vec3& b) {
      return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    };
    for (Vec3& p : points_) p = (p.array().abs() < 1e-60).select(0.0, p);
    std::sort(points_.begin(), points_.end(), before);
    points_.erase(std::unique(points_.begin(), points_.end()), points_.end());
    size_ = (points_.front() - points_.back()).norm();
  }

  Solid build() {
    rings_ = faces_of_hull(points_);
    require(!rings_.empty(), "the points span no solid");
    for (std::size_t i = 0; i < rings_.size(); ++i) add_face(i);
    std::sort(needles_.begin(), needles_.end(), std::greater<>());
    for (const auto& [width, face] : needles_) lean_on_neighbours(face);
    finish();
    return std::move(solid_);
  }

 private:
  [[nodiscard]] double length(std::uint32_t a, std::uint32_t b) const { return (points_[a] - points_[b]).norm(); }

  void add_face(std::size_t i) {
    const std::vector<std::uint32_t>& ring = rings_[i];
    Vec3 area = Vec3::Zero();
    Vec3 longest = Vec3::Zero();
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::uint32_t from = ring[k], to = ring[(k + 1) % ring.size()];
      area += (points_[from] - points_[ring[0]]).cross(points_[to] - points_[ring[0]]);
      const Vec3 side = points_[to] - points_[from];
      if (side.squaredNorm() > longest.squaredNorm()) longest = side;
      left_of_[{from, to}] = i;
    }
    const double width = area.norm() / longest.norm();
    // Rounding in the area vector of a narrow face may turn the normal only about the face's longest edge. So the
    // component along this edge is removed.
    for (int k = 0; k < 2; ++k) area -= area.dot(longest) / longest.squaredNorm() * longest;
    normals_.push_back(area.normalized());
    if (!(width > kNeedle * size_)) needles_.emplace_back(width, i);
  }

  // Sets the normal of a narrow face to lie between the normals of the faces beyond its two longest edges.
  void lean_on_neighbours(std::size_t face) {
    const std::vector<std::uint32_t>& ring = rings_[face];
    std::vector<std::pair<double, std::size_t>> beyond;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::uint32_t from = ring[k], to = ring[(k + 1) % ring.size()];
      beyond.emplace_back(length(from, to), left_of_.at({to, from}));
    }
    std::sort(beyond.begin(), beyond.end(), std::greater<>());
    normals_[face] = (normals_[beyond[0].second] + normals_[beyond[1].second]).normalized();
  }

  void finish() {
    std::vector<std::uint32_t> number(points_.size(), ~0U);
    for (std::size_t i = 0; i < rings_.size(); ++i) {
      const Vec3& n = normals_[i];
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const Vec3& p : points_) low = std::min(low, n.dot(p));
      for (const std::uint32_t j : rings_[i]) high = std::max(high, n.dot(points_[j]));
      require(high - low > kThin * size_, "the points span no solid");
      solid_.faces.push_back(
          {n, high, static_cast<std::uint32_t>(solid_.ring.size()), static_cast<std::uint32_t>(rings_[i].size())});
      for (const std::uint32_t j : rings_[i]) {
        if (number[j] == ~0U) {
          number[j] = static_cast<std::uint32_t>(solid_.points.size());
          solid_.points.push_back(points_[j]);
        }
        solid_.ring.push_back(number[j]);
      }
    }
    for (const auto& [edge, face] : left_of_) {
      const auto [from, to] = edge;
      if (from < to) {
        solid_.edges.push_back({number[from], number[to], normals_[face], normals_[left_of_.at({to, from})]});
      }
    }
  }

  std::vector<Vec3> points_;
  double size_ = 0.0;
  std::vector<std::vector<std::uint32_t>> rings_;
  std::vector<Vec3> normals_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> left_of_;  // the face to the left of an edge
  std::vector<std::pair<double, std::size_t>> needles_;                     // width and index of each narrow face
  Solid solid_;
};

}  // namespace

Solid solid_of(const SphereTool& shape, const Pose& X) {
  require(shape.radius_m > 0.0, "a radius must be above 0");
  Solid solid;
  solid.points = {X.translation()};
  solid.radius = shape.radius_m;
  return finished(std::move(solid));
}

Solid solid_of(const CapsuleTool& shape, const Pose& X) {
  require(shape.radius_m > 0.0 && shape.length_m > 0.0, "length and radius must be above 0");
  Solid solid;
  const Vec3 half = 0.5 * shape.length_m * Vec3::UnitZ();
  solid.points = {X * Vec3(-half), X * half};
  solid.edges = {{0, 1, Vec3::Zero(), Vec3::Zero()}};
  solid.radius = shape.radius_m;
  return finished(std::move(solid));
}

Solid solid_of(const BoxTool& shape, const Pose& X) {
  require(shape.size_m.minCoeff() > 0.0, "a box's size must be above 0");
  ConvexTool corners;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    corners.points_m.push_back(sign.cwiseProduct(shape.size_m));
  }
  return solid_of(corners, X);
}

Solid solid_of(const CylinderTool& shape, const Pose& X) {
  require(shape.radius_m > 0.0 && shape.length_m > 0.0, "length and radius must be above 0");
  Solid solid;
  const Vec3 u = X.linear().col(0), v = X.linear().col(1), half = 0.5 * shape.length_m * X.linear().col(2);
  solid.rims = {{X.translation() - half, u, v, shape.radius_m}, {X.translation() + half, u, v, shape.radius_m}};
  return finished(std::move(solid));
}

Solid solid_of(const ConvexTool& shape, const Pose& X) {
  require(shape.points_m.size() >= 4, "the points span no solid");
  std::vector<Vec3> points;
  for (const Vec3& p : shape.points_m) points.push_back(X * p);
  try {
    return finished(Hull(points).build());
  } catch (const std::invalid_argument&) {
    return finished(ExactHull(std::move(points)).build());
  }
}

double reach_of(const Tool& tool) {
  double reach = 0.0;
  for (const ToolPart& part : tool.parts) {
    std::visit(
        [&](const auto& shape) {
          if constexpr (requires { shape.points_m; }) {  // the reach of a hull is that of its points
            for (const Vec3& p : shape.points_m) reach = std::max(reach, (part.X_TP * p).norm());
          } else {
            reach = std::max(reach, solid_of(shape, part.X_TP).reach);
          }
        },
        part.shape);
  }
  return reach;
}

}  // namespace proxarm::models
