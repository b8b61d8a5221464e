#include "models/mesh/polygon.hpp"

#include <cmath>

namespace proxarm::models {
namespace {

// A point in the plane. In long double, the product of two differences is exact for coordinates in float, and has an
// error of 2⁻⁶³ for coordinates in double.
struct Flat {
  long double x, y;
  bool operator==(const Flat&) const = default;
};

long double turn(const Flat& a, const Flat& b, const Flat& c) noexcept {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Returns the corners projected onto the coordinate plane in which the polygon has the largest area, counter-clockwise.
// Returns an empty list if the polygon has no net area, such as a bow with equal halves.
std::vector<Flat> flattened(std::span<const Vec3> vertices, std::span<const std::uint32_t> corners) {
  Vec3 normal = Vec3::Zero();
  const Vec3& origin = vertices[corners[0]];
  for (std::size_t k = 0; k < corners.size(); ++k) {
    normal += (vertices[corners[k]] - origin).cross(vertices[corners[(k + 1) % corners.size()]] - origin);
  }
  if (normal.isZero(0.0)) return {};
  Eigen::Index away = 0;
  normal.cwiseAbs().maxCoeff(&away);
  Eigen::Index right = (away + 1) % 3, up = (away + 2) % 3;
  if (normal[away] < 0.0) std::swap(right, up);
  std::vector<Flat> flat;
  flat.reserve(corners.size());
  for (const std::uint32_t corner : corners) flat.push_back({vertices[corner][right], vertices[corner][up]});
  return flat;
}

// The corners that are not yet cut off, as a ring.
class Ring {
 public:
  explicit Ring(std::vector<Flat> flat) : flat_(std::move(flat)), left_(flat_.size()) {
    for (std::size_t k = 0; k < left_.size(); ++k) left_[k] = k;
  }
  [[nodiscard]] std::size_t size() const noexcept { return left_.size(); }
  // Precondition: size() > 0.
  [[nodiscard]] std::array<std::size_t, 3> at(std::size_t k) const noexcept {
    return {left_[(k + left_.size() - 1) % left_.size()], left_[k], left_[(k + 1) % left_.size()]};
  }
  void cut(std::size_t k) { left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(k)); }

  // Whether corner k may be cut off: it turns left, and no other corner is in the triangle of k and its neighbours. A
  // corner at the same place as a corner of this triangle belongs to a seam and doesn't count.
  [[nodiscard]] bool is_ear(std::size_t k) const noexcept {
    const auto [before, here, after] = at(k);
    const Flat &a = flat_[before], &b = flat_[here], &c = flat_[after];
    if (!(turn(a, b, c) > 0.0L)) return false;
    for (const std::size_t other : left_) {
      const Flat& p = flat_[other];
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0.0L && turn(b, c, p) >= 0.0L && turn(c, a, p) >= 0.0L) return false;
    }
    return true;
  }

  // Returns twice the area of the triangle of corner k and its neighbours: 0 if the three corners are in line.
  [[nodiscard]] long double turn_at(std::size_t k) const noexcept {
    const auto [before, here, after] = at(k);
    return turn(flat_[before], flat_[here], flat_[after]);
  }

 private:
  std::vector<Flat> flat_;
  std::vector<std::size_t> left_;
};

}  // namespace

bool triangulate(std::span<const Vec3> vertices, std::span<const std::uint32_t> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const std::size_t first = triangles.size();
  Ring ring(flattened(vertices, corners));
  const auto find = [&ring](auto suits) {
    std::size_t k = 0;
    while (k < ring.size() && !suits(k)) ++k;
    return k;
  };
  while (ring.size() > 3) {
    std::size_t k = find([&ring](std::size_t at) { return ring.is_ear(at); });
    if (k == ring.size()) k = find([&ring](std::size_t at) { return ring.turn_at(at) == 0.0L; });
    if (k == ring.size()) break;
    const auto [a, b, c] = ring.at(k);
    triangles.push_back({corners[a], corners[b], corners[c]});
    ring.cut(k);
  }
  if (ring.size() == 3 && ring.turn_at(1) >= 0.0L) {
    const auto [a, b, c] = ring.at(1);
    triangles.push_back({corners[a], corners[b], corners[c]});
    return true;
  }
  triangles.resize(first);
  for (std::size_t k = 2; k < corners.size(); ++k) triangles.push_back({corners[0], corners[k - 1], corners[k]});
  return false;
}

}  // namespace proxarm::models
