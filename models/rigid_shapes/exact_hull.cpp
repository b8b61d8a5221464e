#include "models/rigid_shapes/exact_hull.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "models/mesh/mesh_predicates.hpp"

namespace proxarm::models {
namespace {

// Computes the hull by gift wrapping: from each face, it goes over the face's edges to the neighbouring faces. Seen
// along an edge of the hull, all points are within half a turn, so they can be ordered by how far out they are.
class Wrapping {
 public:
  explicit Wrapping(const std::vector<Vec3>& points) : points_(points) {}

  std::vector<std::vector<std::uint32_t>> faces() {
    const std::optional<Plane> first = first_plane();
    if (!first || !add_face(*first)) return {};
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const std::vector<std::uint32_t> ring = faces_[i];
      for (std::size_t k = 0; k < ring.size(); ++k) {
        const std::uint32_t from = ring[(k + 1) % ring.size()], to = ring[k];
        if (face_left_of_.contains({from, to})) continue;
        if (!add_face(over(from, to))) return {};
      }
    }
    return std::move(faces_);
  }

 private:
  struct Plane {
    // No point is in front of the plane; from and to are the ends of an edge of its face.
    std::uint32_t from = 0, to = 0, third = 0;
  };

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(points_.size()); }
  [[nodiscard]] int side(const Plane& plane, std::uint32_t x) const {
    return orientation(points_[plane.from], points_[plane.to], points_[plane.third], points_[x]);
  }

  // Finds a first edge of the hull and returns the plane of the face beside it. The edge lies in a plane parallel to z
  // that has all points on one side.
  [[nodiscard]] std::optional<Plane> first_plane() const {
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
      return std::lexicographical_compare(points_[a].data(), points_[a].data() + 3, points_[b].data(),
                                          points_[b].data() + 3);
    };
    std::uint32_t a = 0;
    for (std::uint32_t x = 1; x < size(); ++x) {
      if (before(x, a)) a = x;
    }
    const Vec3 above(points_[a].x(), points_[a].y(), points_[a].z() + 1.0);
    std::optional<std::uint32_t> b;
    for (std::uint32_t x = 0; x < size(); ++x) {
      if (points_[x].head<2>() == points_[a].head<2>()) continue;
      if (!b || orientation(points_[a], points_[*b], above, points_[x]) > 0) b = x;
    }
    if (!b) return {};
    std::vector<std::uint32_t> on;
    for (std::uint32_t x = 0; x < size(); ++x) {
      if (orientation(points_[a], points_[*b], above, points_[x]) == 0) on.push_back(x);
    }
    // a is the first of these points, and therefore a corner of their outline. The outline's edges connect neighbouring
    // corners. The neighbour of a is the point for which all other points are on one side of the line from a through
    // it, seen within the plane.
    const std::optional<std::uint32_t> off = off_plane(a, *b, above);
    if (!off) return {};
    const std::uint32_t to = next_corner(a, on, *off);
    return over(a, to);
  }

  [[nodiscard]] std::optional<std::uint32_t> off_plane(std::uint32_t a, std::uint32_t b, const Vec3& above) const {
    for (std::uint32_t x = 0; x < size(); ++x) {
      if (orientation(points_[a], points_[b], above, points_[x]) != 0) return x;
    }
    return {};
  }

  // Returns the plane to the left of an edge that has all points behind it.
  [[nodiscard]] Plane over(std::uint32_t from, std::uint32_t to) const {
    std::optional<std::uint32_t> third;
    for (std::uint32_t x = 0; x < size(); ++x) {
      if (x == from || x == to || collinear(points_[from], points_[to], points_[x])) continue;
      if (!third || side({from, to, *third}, x) > 0) third = x;
    }
    return {from, to, third.value_or(from)};
  }

  // Returns the corner after `at` on the outline of points that lie in one plane: counter-clockwise, as seen from the
  // side of the plane opposite to `behind`. If several points lie on the outline's line from `at`, the furthest of them
  // is returned. Precondition: `at` is a corner of the outline.
  [[nodiscard]] std::uint32_t next_corner(std::uint32_t at, const std::vector<std::uint32_t>& on,
                                          std::uint32_t behind) const {
    std::uint32_t next = at;
    for (const std::uint32_t x : on) {
      if (x == at) continue;
      if (next == at) {
        next = x;
        continue;
      }
      const int left = -orientation(points_[at], points_[next], points_[x], points_[behind]);
      const double further = (points_[x] - points_[at]).norm() - (points_[next] - points_[at]).norm();
      if (left < 0 || (left == 0 && further > 0.0)) next = x;
    }
    return next;
  }

  bool add_face(const Plane& plane) {
    if (plane.third == plane.from) return false;
    std::vector<std::uint32_t> on;
    std::optional<std::uint32_t> behind;
    for (std::uint32_t x = 0; x < size(); ++x) {
      const int s = side(plane, x);
      if (s == 0) on.push_back(x);
      if (s < 0) behind = x;
    }
    if (!behind) return false;
    std::vector<std::uint32_t> ring{plane.from};
    for (std::uint32_t at = next_corner(plane.from, on, *behind); at != plane.from; at = next_corner(at, on, *behind)) {
      if (ring.size() > on.size()) return false;
      ring.push_back(at);
    }
    for (std::size_t k = 0; k < ring.size(); ++k) {
      face_left_of_[{ring[k], ring[(k + 1) % ring.size()]}] = faces_.size();
    }
    faces_.push_back(std::move(ring));
    return true;
  }

  const std::vector<Vec3>& points_;
  std::vector<std::vector<std::uint32_t>> faces_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> face_left_of_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> faces_of_hull(const std::vector<Vec3>& points) {
  if (points.size() < 4) return {};
  return Wrapping(points).faces();
}

}  // namespace proxarm::models
