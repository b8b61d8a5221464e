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
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

float rounded_down(double x) noexcept {
  const auto f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}

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

TriangleMesh::Around::Around(const Vec3& point) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    const double at = point[static_cast<Eigen::Index>(k)];
    const float up = -rounded_down(-at), down = -rounded_down(at);
    x[k] = {up, up, down, down};
  }
}

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
  build();
  make_faces();
  check_closed();
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
  std::fill(place.begin(), place.end(), kUnused);
  for (auto triangle : soup.triangles) {
    for (std::uint32_t& index : triangle) index = becomes[index];
    const Vec3 &a = given[triangle[0]], &b = given[triangle[1]], &c = given[triangle[2]];
    if (collinear(a, b, c)) {
      ++dropped_;
      continue;
    }
    for (std::uint32_t& index : triangle) {
      if (place[index] == kUnused) {
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
    Face face{a, normal_of<long double>(a, b, c, thin), 1.0, 0.0};
    // The cross product is wrong by 2⁻⁶³ of the sides' product: more than u of its length in a thin triangle.
    if (!(thin > 1e-2)) face.normal = normal_of<Wide>(a, b, c, thin);
    if (!(thin > 1e-15)) face.trust = std::numeric_limits<double>::infinity();
    face.offset = face.normal.dot(face.corner);
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

// Halves the triangles by the middles of their boxes along the longest side of those middles' box, until few are left;
// then puts triangles and vertices in that order.
void TriangleMesh::build() {
  const auto count = static_cast<std::uint32_t>(size());
  struct Item {
    std::array<float, 3> low, high, middle;
    std::uint32_t triangle;
  };
  std::vector<Item> items(count);
  bounds_ = {corner(0, 0), corner(0, 0)};
  for (std::uint32_t t = 0; t < count; ++t) {
    const Vec3 low = corner(t, 0).cwiseMin(corner(t, 1)).cwiseMin(corner(t, 2));
    const Vec3 high = corner(t, 0).cwiseMax(corner(t, 1)).cwiseMax(corner(t, 2));
    bounds_ = {bounds_.low.cwiseMin(low), bounds_.high.cwiseMax(high)};
    Item& item = items[t];
    item.triangle = t;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      item.low[i] = rounded_down(low[k]);
      item.high[i] = -rounded_down(-high[k]);
      item.middle[i] = 0.5f * (item.low[i] + item.high[i]);
    }
  }
  struct Part {
    std::uint32_t begin, end, pair, of;  // `of`: which of the pair it is
  };
  nodes_.reserve(count / (kLeaf / 2) + 2);
  nodes_.emplace_back();
  // The root is alone in its pair; the other one is nowhere.
  constexpr float nowhere = std::numeric_limits<float>::infinity();
  for (auto& axis : nodes_[0].box) axis << 0.0f, nowhere, 0.0f, -nowhere;
  std::vector<Part> parts{{0, count, 0, 0}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    NodePair& pair = nodes_[part.pair];
    std::array<float, 3> box_low = items[part.begin].low, box_high = items[part.begin].high;
    std::array<float, 3> low = items[part.begin].middle, high = low;
    for (std::uint32_t i = part.begin; i < part.end; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        box_low[k] = std::min(box_low[k], items[i].low[k]);
        box_high[k] = std::max(box_high[k], items[i].high[k]);
        low[k] = std::min(low[k], items[i].middle[k]);
        high[k] = std::max(high[k], items[i].middle[k]);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      pair.box[k][static_cast<Eigen::Index>(part.of)] = box_low[k];
      pair.box[k][static_cast<Eigen::Index>(part.of) + 2] = -box_high[k];
    }
    if (part.end - part.begin <= kLeaf) {
      pair.first[part.of] = part.begin;
      pair.count[part.of] = part.end - part.begin;
    } else {
      std::size_t axis = 0;
      for (std::size_t k = 1; k < 3; ++k) axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
      const std::uint32_t half = part.begin + (part.end - part.begin) / 2;
      const auto at = [&items](std::uint32_t i) { return items.begin() + static_cast<std::ptrdiff_t>(i); };
      std::nth_element(at(part.begin), at(half), at(part.end), [axis](const Item& a, const Item& b) {
        return a.middle[axis] < b.middle[axis] || (a.middle[axis] == b.middle[axis] && a.triangle < b.triangle);
      });
      const auto within = static_cast<std::uint32_t>(nodes_.size());
      pair.first[part.of] = within;
      nodes_.emplace_back();
      parts.push_back({half, part.end, within, 1});
      parts.push_back({part.begin, half, within, 0});
    }
  }

  std::vector<std::array<std::uint32_t, 3>> triangles(count);
  for (std::uint32_t t = 0; t < count; ++t) triangles[t] = triangles_[items[t].triangle];
  triangles_ = std::move(triangles);
  std::vector<Vec3> vertices;
  vertices.reserve(vertices_.size());
  std::vector<std::uint32_t> place(vertices_.size(), kUnused);
  for (auto& triangle : triangles_) {
    for (std::uint32_t& index : triangle) {
      if (place[index] == kUnused) {
        place[index] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(vertices_[index]);
      }
      index = place[index];
    }
  }
  vertices_ = std::move(vertices);
}

int TriangleMesh::side_exactly(std::uint32_t f, const Vec3& x) const noexcept {
  return orientation(corner(f, 0), corner(f, 1), corner(f, 2), x);
}

int TriangleMesh::side(std::uint32_t f, const Vec3& x) const noexcept {
  const double h = height(faces_[f], x), d = doubt(faces_[f], x.lpNorm<1>());
  return h > d ? 1 : h < -d ? -1 : side_exactly(f, x);
}

bool TriangleMesh::touched_by(std::uint32_t f, const Vec3& x, const Vec3& y) const noexcept {
  return segment_touches_triangle(x, y, corner(f, 0), corner(f, 1), corner(f, 2));
}

void TriangleMesh::test_exactly(std::uint32_t f, int side_x, int side_y, double h_x, double h_y, const Vec3& x,
                                const Vec3& y, Hit& hit) const noexcept {
  if (!segment_touches_triangle(x, y, side_x, side_y, corner(f, 0), corner(f, 1), corner(f, 2))) return;
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
  const auto passes = [&](const NodePair& pair, std::size_t of) {
    double enter = 0.0, leave = 1.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double low = pair.low(of, k) - margin - x[k], high = pair.high(of, k) + margin - x[k];
      if (std::abs(d[k]) <= margin) {
        // Along this axis it stays where it is, within the margin.
        if (low > margin || high < -margin) return false;
        continue;
      }
      const double a = low * one_over[k], b = high * one_over[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    constexpr double slack = 1e-14;  // two roundings of shares of about one, many times over
    return !(enter > leave + slack || enter > share() + slack);
  };
  std::uint32_t stack[kDepth];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const NodePair& pair = nodes_[stack[--top]];
    for (std::size_t k = 0; k < 2; ++k) {
      if (!passes(pair, k)) continue;
      if (pair.count[k] == 0) stack[top++] = pair.first[k];
      for (std::uint32_t f = pair.first[k]; f < pair.first[k] + pair.count[k]; ++f) visit(f);
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

double TriangleMesh::distance_at_least(const Vec3& x, double most, std::uint32_t& near, double share) const noexcept {
  const double share2 = share * share;
  const Around around(x);
  double least = std::min(most * most, face_distance2(near, x));
  struct Waiting {
    std::uint32_t pair;
    double distance2;
  };
  Waiting stack[kDepth];
  int top = 0;
  stack[top++] = {0, 0.0};
  while (top > 0) {
    const Waiting waiting = stack[--top];
    if (!(waiting.distance2 < share2 * least)) continue;
    const NodePair& pair = nodes_[waiting.pair];
    const std::array<double, 2> d2 = pair.distance2(around);
    const std::size_t nearer = d2[1] < d2[0] ? 1 : 0;
    // The nearer of two inner nodes is looked at next; faces at once.
    for (const std::size_t k : {1 - nearer, nearer}) {
      if (!(d2[k] < share2 * least)) continue;
      if (pair.count[k] == 0) stack[top++] = {pair.first[k], d2[k]};
      for (std::uint32_t f = pair.first[k]; f < pair.first[k] + pair.count[k]; ++f) {
        const double face2 = face_distance2(f, x);
        if (face2 < least) {
          least = face2;
          near = f;
        }
      }
    }
  }
  return share * std::sqrt(least);
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
