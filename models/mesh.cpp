#include "models/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

#include "models/mesh_predicates.hpp"

namespace proxarm::models {
namespace {

constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
constexpr std::uint32_t kLeaf = 4;  // faces per leaf

#ifdef __SIZEOF_FLOAT128__
__extension__ using Wide = __float128;
#else
using Wide = long double;
#endif

// (b − a) × (c − a) in numbers wider than double, as a unit vector; `thin` is its length over ‖b − a‖ ‖c − a‖.
template <typename Number>
Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c, double& thin) {
  const auto difference = [](double x, double y) { return static_cast<Number>(x) - static_cast<Number>(y); };
  const Number v[3] = {difference(b.x(), a.x()), difference(b.y(), a.y()), difference(b.z(), a.z())};
  const Number w[3] = {difference(c.x(), a.x()), difference(c.y(), a.y()), difference(c.z(), a.z())};
  Number n[3];
  Number largest = 0;
  for (int k = 0; k < 3; ++k) {
    n[k] = v[(k + 1) % 3] * w[(k + 2) % 3] - v[(k + 2) % 3] * w[(k + 1) % 3];
    largest = std::max(largest, n[k] < 0 ? -n[k] : n[k]);
  }
  const double scale = (b - a).norm() * (c - a).norm();
  thin = static_cast<double>(largest) / scale;
  if (!(largest > 0)) return Vec3::UnitZ();
  const Vec3 scaled(static_cast<double>(n[0] / largest), static_cast<double>(n[1] / largest),
                    static_cast<double>(n[2] / largest));
  return scaled / scaled.norm();
}

}  // namespace

TriangleMesh::TriangleMesh(TriangleSoup soup) {
  if (soup.triangles.empty()) throw std::invalid_argument("a mesh needs at least one triangle");
  if (soup.vertices.size() >= std::numeric_limits<std::uint32_t>::max() / 8 || soup.triangles.size() >= (1u << 29)) {
    throw std::invalid_argument("a mesh of more than half a billion triangles");
  }
  for (std::size_t i = 0; i < soup.vertices.size(); ++i) {
    for (double& x : soup.vertices[i]) {
      if (!(std::abs(x) <= 1e9)) {
        throw std::invalid_argument("vertex " + std::to_string(i) +
                                    " has a coordinate that isn't finite or beyond 1e9");
      }
      if (std::abs(x) < 1e-60) x = 0.0;  // what mesh_predicates.hpp asks for; also −0, which is no other place than 0
    }
  }
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    for (const std::uint32_t index : soup.triangles[t]) {
      if (index >= soup.vertices.size()) {
        throw std::invalid_argument("triangle " + std::to_string(t) + " has vertex " + std::to_string(index) + " of " +
                                    std::to_string(soup.vertices.size()));
      }
    }
  }
  weld(soup);
  if (triangles_.empty()) throw std::invalid_argument("none of the triangles has an area");
  make_faces();
  check_closed();
  build();
}

// Vertices with the same coordinates become one, triangles without area go; vertices that nothing uses stay behind.
void TriangleMesh::weld(TriangleSoup& soup) {
  const auto& given = soup.vertices;
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    return std::lexicographical_compare(given[a].data(), given[a].data() + 3, given[b].data(), given[b].data() + 3);
  };
  std::vector<std::uint32_t> sorted(given.size()), becomes(given.size()), place(given.size());
  std::iota(sorted.begin(), sorted.end(), 0u);
  std::sort(sorted.begin(), sorted.end(),
            [&](std::uint32_t a, std::uint32_t b) { return before(a, b) || (!before(b, a) && a < b); });
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const bool same = i > 0 && given[sorted[i]] == given[sorted[i - 1]];
    becomes[sorted[i]] = same ? becomes[sorted[i - 1]] : sorted[i];
  }
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::fill(place.begin(), place.end(), unused);
  for (auto triangle : soup.triangles) {
    for (std::uint32_t& index : triangle) index = becomes[index];
    const Vec3 &a = given[triangle[0]], &b = given[triangle[1]], &c = given[triangle[2]];
    if (collinear(a, b, c)) {
      ++dropped_;
      continue;
    }
    for (std::uint32_t& index : triangle) {
      if (place[index] == unused) {
        place[index] = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(given[index]);
      }
      index = place[index];
    }
    triangles_.push_back(triangle);
  }
}

void TriangleMesh::make_faces() {
  faces_.reserve(triangles_.size());
  double largest = 0.0, edges = 0.0;
  for (const auto& triangle : triangles_) {
    const Vec3 &a = vertices_[triangle[0]], &b = vertices_[triangle[1]], &c = vertices_[triangle[2]];
    double thin = 0.0;
    Face face{a, normal_of<long double>(a, b, c, thin), 1.0};
    // The cross product is wrong by 2⁻⁶³ of the sides' product: more than u of its length in a thin triangle.
    if (!(thin > 1e-2)) face.normal = normal_of<Wide>(a, b, c, thin);
    if (!(thin > 1e-15)) face.trust = std::numeric_limits<double>::infinity();
    faces_.push_back(face);
    largest = std::max({largest, a.lpNorm<1>(), b.lpNorm<1>(), c.lpNorm<1>()});
    edges += (b - a).norm() + (c - b).norm() + (a - c).norm();
  }
  mean_edge_ = edges / (3.0 * static_cast<double>(triangles_.size()));
  lift_ = 64.0 * u * largest;
}

void TriangleMesh::check_closed() {
  std::vector<std::uint64_t> forth, back;
  forth.reserve(3 * size());
  back.reserve(3 * size());
  for (const auto& t : triangles_) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      (a < b ? forth : back).push_back(a < b ? (a << 32 | b) : (b << 32 | a));
    }
  }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  closed_ = forth == back;
}

void TriangleMesh::build() {
  const auto count = static_cast<std::uint32_t>(size());
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<Vec3> middle(count);
  for (std::uint32_t f = 0; f < count; ++f) middle[f] = (corner(f, 0) + corner(f, 1) + corner(f, 2)) / 3.0;
  nodes_.reserve(2 * (count / (kLeaf / 2) + 1));
  nodes_.emplace_back();
  struct Part {
    std::uint32_t node, begin, end;
  };
  std::vector<Part> parts{{0, 0, count}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    Node node;
    node.low = node.high = corner(order_[part.begin], 0);
    Vec3 low = middle[order_[part.begin]], high = low;
    for (std::uint32_t i = part.begin; i < part.end; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        node.low = node.low.cwiseMin(corner(order_[i], k));
        node.high = node.high.cwiseMax(corner(order_[i], k));
      }
      low = low.cwiseMin(middle[order_[i]]);
      high = high.cwiseMax(middle[order_[i]]);
    }
    if (part.end - part.begin <= kLeaf) {
      node.first = part.begin;
      node.count = part.end - part.begin;
    } else {
      Eigen::Index axis = 0;
      (high - low).maxCoeff(&axis);
      const std::uint32_t half = part.begin + (part.end - part.begin) / 2;
      const auto at = [this](std::uint32_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
      std::nth_element(at(part.begin), at(half), at(part.end), [&middle, axis](std::uint32_t a, std::uint32_t b) {
        return middle[a][axis] < middle[b][axis] || (middle[a][axis] == middle[b][axis] && a < b);
      });
      node.first = static_cast<std::uint32_t>(nodes_.size());
      nodes_.emplace_back();
      nodes_.emplace_back();
      parts.push_back({node.first + 1, half, part.end});
      parts.push_back({node.first, part.begin, half});
    }
    nodes_[part.node] = node;
  }
}

int TriangleMesh::side(std::uint32_t f, const Vec3& x) const noexcept {
  const double h = height(faces_[f], x), d = doubt(faces_[f], x.lpNorm<1>());
  if (h > d) return 1;
  if (h < -d) return -1;
  return orientation(corner(f, 0), corner(f, 1), corner(f, 2), x);
}

bool TriangleMesh::touched_by(std::uint32_t f, const Vec3& x, const Vec3& y) const noexcept {
  return segment_touches_triangle(x, y, corner(f, 0), corner(f, 1), corner(f, 2));
}

void TriangleMesh::test_exactly(std::uint32_t f, double h_x, double h_y, const Vec3& x, const Vec3& y,
                                Hit& hit) const noexcept {
  if (!touched_by(f, x, y)) return;
  const double fall = h_x - h_y;
  const double share = fall != 0.0 ? h_x / fall : 0.0;
  hit.consider(f, share > 0.0 ? std::min(share, 1.0) : 0.0);
}

// Calls visit(face) for all faces in boxes that the way from x to y passes before `share()` of it.
template <typename Share, typename Visit>
void TriangleMesh::along(const Vec3& x, const Vec3& y, Share share, Visit visit) const noexcept {
  // Slabs. The box is passed if the way is within its bounds on all axes at once; rounding of the shares is paid for by
  // letting boxes be a little larger than they are.
  const Vec3 d = y - x;
  const Vec3 one_over(1.0 / d.x(), 1.0 / d.y(), 1.0 / d.z());
  const double margin = 16.0 * u * (x.lpNorm<1>() + y.lpNorm<1>());
  std::uint32_t stack[kDepth];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    double enter = 0.0, leave = 1.0;
    bool apart = false;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double low = node.low[k] - margin - x[k], high = node.high[k] + margin - x[k];
      if (std::abs(d[k]) <= margin) {
        // Along this axis it stays where it is, within the margin.
        apart = apart || low > margin || high < -margin;
        continue;
      }
      const double a = low * one_over[k], b = high * one_over[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    constexpr double slack = 1e-14;  // two roundings of shares of about one, many times over
    if (apart || enter > leave + slack || enter > share() + slack) continue;
    if (node.count > 0) {
      for (std::uint32_t k = 0; k < node.count; ++k) visit(order_[node.first + k]);
    } else {
      stack[top++] = node.first;
      stack[top++] = node.first + 1;
    }
  }
}

TriangleMesh::Hit TriangleMesh::first_hit(const Vec3& x, const Vec3& y) const noexcept {
  Hit hit;
  const double size_x = x.lpNorm<1>(), size_y = y.lpNorm<1>();
  along(
      x, y, [&hit] { return hit.share; }, [&](std::uint32_t f) { test(f, faces_[f], x, y, size_x, size_y, hit); });
  return hit;
}

// By how often a way out passes the surface; ways that meet an edge or a vertex are not counted but replaced.
bool TriangleMesh::encloses(const Vec3& x) const noexcept {
  const double reach = 2.0 * ((bounds().high - bounds().low).norm() + (x - bounds().low).norm());
  for (int attempt = 1; attempt <= 8; ++attempt) {
    const Vec3 away(std::sin(1.7 * attempt), std::cos(2.3 * attempt), std::sin(0.9 * attempt + 0.5));
    const Vec3 y = x + reach * away.normalized();
    bool odd = false, clean = true;
    along(
        x, y, [] { return 1.0; },
        [&](std::uint32_t f) {
          if (!touched_by(f, x, y)) return;
          odd = !odd;
          for (std::size_t k = 0; k < 3; ++k)
            clean = clean && orientation(x, y, corner(f, k), corner(f, (k + 1) % 3)) != 0;
        });
    if (clean) return odd;
  }
  return std::abs(winding(x)) > 0.5;
}

// The squared distance to a triangle: to its plane's point if that is within all three sides, else to the nearest side.
double TriangleMesh::face_distance2(std::uint32_t f, const Vec3& x) const noexcept {
  const Face& face = faces_[f];
  const Vec3 p[3] = {corner(f, 0), corner(f, 1), corner(f, 2)};
  double least = std::numeric_limits<double>::infinity();
  bool within = face.trust == 1.0;  // else it is thinner than rounding: its sides are all there is
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = p[(k + 1) % 3] - p[k], d = x - p[k];
    if (face.trust == 1.0 && !(e.cross(face.normal).dot(d) > 0.0)) continue;
    within = false;
    const double along = std::clamp(e.dot(d) / e.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (d - along * e).squaredNorm());
  }
  if (!within) return least;
  const double h = height(face, x);
  return h * h;
}

double TriangleMesh::distance(const Vec3& x, double most, std::uint32_t& near) const noexcept {
  double least = most * most;
  const double first = face_distance2(near, x);
  least = std::min(least, first);
  struct Waiting {
    std::uint32_t node;
    double distance2;
  };
  Waiting stack[kDepth];
  int top = 0;
  stack[top++] = {0, nodes_[0].distance2(x)};
  while (top > 0) {
    const Waiting waiting = stack[--top];
    if (!(waiting.distance2 < least)) continue;
    const Node& node = nodes_[waiting.node];
    if (node.count > 0) {
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const double d2 = face_distance2(order_[node.first + k], x);
        if (d2 < least) {
          least = d2;
          near = order_[node.first + k];
        }
      }
      continue;
    }
    const Waiting a{node.first, nodes_[node.first].distance2(x)};
    const Waiting b{node.first + 1, nodes_[node.first + 1].distance2(x)};
    const bool a_first = a.distance2 < b.distance2;
    if ((a_first ? b : a).distance2 < least) stack[top++] = a_first ? b : a;
    if ((a_first ? a : b).distance2 < least) stack[top++] = a_first ? a : b;
  }
  return std::sqrt(least);
}

double TriangleMesh::winding(const Vec3& x) const noexcept {
  double sum = 0.0;
  for (std::uint32_t f = 0; f < size(); ++f) {
    // Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983), equation (8).
    const Vec3 a = corner(f, 0) - x, b = corner(f, 1) - x, c = corner(f, 2) - x;
    const double A = a.norm(), B = b.norm(), C = c.norm();
    const double lower = A * B * C + a.dot(b) * C + b.dot(c) * A + c.dot(a) * B;
    sum += 2.0 * std::atan2(a.dot(b.cross(c)), lower);
  }
  return sum / (4.0 * std::numbers::pi);
}

}  // namespace proxarm::models
