#include "models/mesh/mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>

#include "models/mesh/mesh_predicates.hpp"

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

// Returns (b − a) × (c − a) as a unit vector, computed in numbers wider than double. `thin` becomes the length of the
// cross product over ‖b − a‖ ‖c − a‖.
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
      if (std::abs(x) < 1e-60) x = 0.0;  // required by mesh_predicates.hpp; this also turns −0 into 0
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
  if (structure_.triangles.empty()) throw std::invalid_argument("none of the triangles has an area");
  build();
  bound();
  make_faces();
  check_closed();
}

TriangleMesh TriangleMesh::restored(Structure structure) {
  TriangleMesh mesh;
  mesh.structure_ = std::move(structure);
  const auto require = [](bool fine) {
    if (!fine) throw std::invalid_argument("the mesh's structure is damaged");
  };
  const auto& [vertices, triangles, nodes, dropped, closed] = mesh.structure_;
  require(!triangles.empty() && !nodes.empty() && triangles.size() < (1u << 29) && vertices.size() < (1u << 30));
  for (const auto& triangle : triangles) {
    for (const std::uint32_t index : triangle) require(index < vertices.size());
  }
  for (const Vec3& x : vertices) require((x.array().abs() <= 1e9).all());
  // Each pair must come after the pair that leads to it, and the tree's depth must fit the stack of a search.
  std::vector<int> depth(nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::size_t k = 0; k < (i == 0 ? 1u : 2u); ++k) {
      const std::size_t first = nodes[i].first[k], count = nodes[i].count[k];
      if (count > 0) {
        require(first < triangles.size() && count <= triangles.size() - first);
      } else {
        require(first > i && first < nodes.size() && depth[i] < kDepth - 2);
        depth[first] = std::max(depth[first], depth[i] + 1);
      }
    }
  }
  mesh.empty_second_root();
  mesh.bound();
  mesh.make_faces();
  return mesh;
}

// Merges vertices with the same coordinates, and drops triangles without area and unused vertices.
void TriangleMesh::weld(TriangleSoup& soup) {
  const auto& given = soup.vertices;
  std::vector<std::uint32_t> becomes(given.size()), place(given.size());
  std::vector<std::uint32_t> table(std::bit_ceil(2 * given.size() + 1), kUnused);
  // Multiplicative hashing uses the upper bits of the product. The lower bits would collide, because coordinates from
  // single precision have zeros in their lower 29 bits.
  const int below = 64 - std::countr_zero(table.size());
  for (std::uint32_t i = 0; i < given.size(); ++i) {
    std::uint64_t hash = 0;
    for (const double x : given[i]) hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
    std::size_t at = hash >> below;
    while (table[at] != kUnused && given[table[at]] != given[i]) at = (at + 1) & (table.size() - 1);
    if (table[at] == kUnused) table[at] = i;
    becomes[i] = table[at];
  }
  std::fill(place.begin(), place.end(), kUnused);
  for (auto triangle : soup.triangles) {
    for (std::uint32_t& index : triangle) index = becomes[index];
    const Vec3 &a = given[triangle[0]], &b = given[triangle[1]], &c = given[triangle[2]];
    if (collinear(a, b, c)) {
      ++structure_.dropped;
      continue;
    }
    for (std::uint32_t& index : triangle) {
      if (place[index] == kUnused) {
        place[index] = static_cast<std::uint32_t>(structure_.vertices.size());
        structure_.vertices.push_back(given[index]);
      }
      index = place[index];
    }
    structure_.triangles.push_back(triangle);
  }
}

// The root is alone in its pair. Places the pair's unused box where no query finds it.
void TriangleMesh::empty_second_root() {
  constexpr float nowhere = std::numeric_limits<float>::infinity();
  for (auto& axis : structure_.nodes[0].box) {
    axis[1] = nowhere;
    axis[3] = -nowhere;
  }
}

void TriangleMesh::bound() {
  bounds_ = {vertex(0), vertex(0)};
  for (const Vec3& x : structure_.vertices) bounds_ = {bounds_.low.cwiseMin(x), bounds_.high.cwiseMax(x)};
}

void TriangleMesh::make_faces() {
  faces_.reserve(structure_.triangles.size());
  double largest = 0.0, edges = 0.0;
  for (const auto& triangle : structure_.triangles) {
    const Vec3 &a = structure_.vertices[triangle[0]], &b = structure_.vertices[triangle[1]],
               &c = structure_.vertices[triangle[2]];
    double thin = 0.0;
    Face face{a, normal_of<long double>(a, b, c, thin), 1.0, 0.0};
    // In long double the cross product has an error of 2⁻⁶³ of the product of the sides' lengths. In a thin triangle
    // this error exceeds u of the cross product's length, so the normal is computed in wider numbers.
    if (!(thin > 1e-2)) face.normal = normal_of<Wide>(a, b, c, thin);
    if (!(thin > 1e-15)) face.trust = std::numeric_limits<double>::infinity();
    face.offset = face.normal.dot(face.corner);
    faces_.push_back(face);
    largest = std::max({largest, a.lpNorm<1>(), b.lpNorm<1>(), c.lpNorm<1>()});
    edges += (b - a).norm() + (c - b).norm() + (a - c).norm();
  }
  mean_edge_ = edges / (3.0 * static_cast<double>(structure_.triangles.size()));
  lift_ = 64.0 * u * largest;
}

void TriangleMesh::check_closed() {
  std::vector<std::uint64_t> forth, back;
  forth.reserve(3 * size());
  back.reserve(3 * size());
  for (const auto& t : structure_.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      (a < b ? forth : back).push_back(a < b ? (a << 32 | b) : (b << 32 | a));
    }
  }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  structure_.closed = forth == back;
}

namespace {

// A triangle during the building of the tree: its box, rounded outwards, and the centre of the box.
struct Item {
  std::array<float, 3> low, high, middle;
  std::uint32_t triangle;
};

std::vector<Item> items_of(const TriangleMesh& mesh) {
  std::vector<Item> items(mesh.size());
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    const Vec3 low = mesh.corner(t, 0).cwiseMin(mesh.corner(t, 1)).cwiseMin(mesh.corner(t, 2));
    const Vec3 high = mesh.corner(t, 0).cwiseMax(mesh.corner(t, 1)).cwiseMax(mesh.corner(t, 2));
    Item& item = items[t];
    item.triangle = t;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      item.low[i] = rounded_down(low[k]);
      item.high[i] = -rounded_down(-high[k]);
      item.middle[i] = 0.5f * (item.low[i] + item.high[i]);
    }
  }
  return items;
}

// Puts the half of the items whose centres are lower first. "Lower" is along the longest side of the box around all
// centres.
void halve(std::span<Item> items, const std::array<float, 3>& low, const std::array<float, 3>& high) {
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
  const auto half = items.begin() + static_cast<std::ptrdiff_t>(items.size() / 2);
  std::nth_element(items.begin(), half, items.end(), [axis](const Item& a, const Item& b) {
    return a.middle[axis] < b.middle[axis] || (a.middle[axis] == b.middle[axis] && a.triangle < b.triangle);
  });
}

// Sorts the triangles into the order of the items, and the vertices into the order of their first use.
void put_in_order(const std::vector<Item>& items, TriangleMesh::Structure& structure) {
  std::vector<std::array<std::uint32_t, 3>> triangles(items.size());
  for (std::size_t t = 0; t < items.size(); ++t) triangles[t] = structure.triangles[items[t].triangle];
  structure.triangles = std::move(triangles);
  std::vector<Vec3> vertices;
  vertices.reserve(structure.vertices.size());
  std::vector<std::uint32_t> place(structure.vertices.size(), kUnused);
  for (auto& triangle : structure.triangles) {
    for (std::uint32_t& index : triangle) {
      if (place[index] == kUnused) {
        place[index] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(structure.vertices[index]);
      }
      index = place[index];
    }
  }
  structure.vertices = std::move(vertices);
}

}  // namespace

// Builds the tree by median splits: halves the triangles by the centres of their boxes, along the longest side of the
// box around these centres, until a part fits into a leaf. Then sorts triangles and vertices into the order of the
// tree.
void TriangleMesh::build() {
  const auto count = static_cast<std::uint32_t>(size());
  std::vector<Item> items = items_of(*this);
  struct Part {
    std::uint32_t begin, end, pair, of;  // `of`: index of the node within the pair
  };
  structure_.nodes.reserve(count / (kLeaf / 2) + 2);
  structure_.nodes.emplace_back();
  empty_second_root();
  std::vector<Part> parts{{0, count, 0, 0}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    NodePair& pair = structure_.nodes[part.pair];
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
      const std::uint32_t half = part.begin + (part.end - part.begin) / 2;
      halve(std::span(items).subspan(part.begin, part.end - part.begin), low, high);
      const auto within = static_cast<std::uint32_t>(structure_.nodes.size());
      pair.first[part.of] = within;
      structure_.nodes.emplace_back();
      parts.push_back({half, part.end, within, 1});
      parts.push_back({part.begin, half, within, 0});
    }
  }
  put_in_order(items, structure_);
}

std::size_t TriangleMesh::bytes() const noexcept {
  const auto of = [](const auto& items) { return items.capacity() * sizeof(items[0]); };
  return of(structure_.vertices) + of(structure_.triangles) + of(structure_.nodes) + of(faces_);
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

// Calls visit(face) for all faces in the boxes that the path from x to y enters before the fraction share() of the
// path.
template <typename Share, typename Visit>
void TriangleMesh::along(const Vec3& x, const Vec3& y, Share share, Visit visit) const noexcept {
  // The slab method: the path passes a box if it is within the box's bounds on all axes at once. A margin around the
  // boxes covers the rounding of the fractions.
  const Vec3 d = y - x;
  const Vec3 one_over(1.0 / d.x(), 1.0 / d.y(), 1.0 / d.z());
  const double margin = 16.0 * u * (x.lpNorm<1>() + y.lpNorm<1>());
  const auto passes = [&](const NodePair& pair, std::size_t of) {
    double enter = 0.0, leave = 1.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double low = pair.low(of, k) - margin - x[k], high = pair.high(of, k) + margin - x[k];
      if (std::abs(d[k]) <= margin) {
        // The path doesn't move along this axis, so it is always or never within these bounds.
        if (low > margin || high < -margin) return false;
        continue;
      }
      const double a = low * one_over[k], b = high * one_over[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    constexpr double slack = 1e-14;  // far above the rounding of fractions, which are about 1
    return !(enter > leave + slack || enter > share() + slack);
  };
  std::uint32_t stack[kDepth];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const NodePair& pair = structure_.nodes[stack[--top]];
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

// Counts the faces that a ray from x crosses: x is inside if the number is odd. A ray that meets an edge or a vertex is
// replaced by another ray.
bool TriangleMesh::encloses(const Vec3& x) const noexcept {
  if (!x.allFinite()) return false;
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

// Returns the squared distance from x to a triangle. If the projection of x onto the triangle's plane is within all
// three sides, this is the squared distance to the plane, otherwise that to the nearest side.
double TriangleMesh::face_distance2(std::uint32_t f, const Vec3& x) const noexcept {
  const Face& face = faces_[f];
  const Vec3 p[3] = {corner(f, 0), corner(f, 1), corner(f, 2)};
  double least = std::numeric_limits<double>::infinity();
  bool within = face.trust == 1.0;  // a triangle thinner than rounding has sides only
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
    const NodePair& pair = structure_.nodes[waiting.pair];
    const std::array<double, 2> d2 = pair.distance2(around);
    const std::size_t nearer = d2[1] < d2[0] ? 1 : 0;
    // Faces are tested immediately. Of two inner nodes, the nearer node is visited next.
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
    // Source: Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983), equation (8).
    const Vec3 a = corner(f, 0) - x, b = corner(f, 1) - x, c = corner(f, 2) - x;
    const double A = a.norm(), B = b.norm(), C = c.norm();
    const double lower = A * B * C + a.dot(b) * C + b.dot(c) * A + c.dot(a) * B;
    sum += 2.0 * std::atan2(a.dot(b.cross(c)), lower);
  }
  return sum / (4.0 * std::numbers::pi);
}

}  // namespace proxarm::models
