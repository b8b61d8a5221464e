#include "models/mesh/mesh_repair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace proxarm::models {
namespace {

using Corners = std::array<std::uint32_t, 3>;

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) noexcept {
  return a < b ? (std::uint64_t{a} << 32 | b) : (std::uint64_t{b} << 32 | a);
}

// Returns the ends of all edges that have one face, sorted.
std::vector<std::uint32_t> border_corners(const TriangleSoup& soup) {
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * soup.triangles.size());
  for (const Corners& t : soup.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(edge_key(t[k], t[(k + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  std::vector<std::uint32_t> corners;
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    for (last = first + 1; last < edges.size() && edges[last] == edges[first];) ++last;
    if (last - first > 1) continue;
    corners.push_back(static_cast<std::uint32_t>(edges[first] >> 32));
    corners.push_back(static_cast<std::uint32_t>(edges[first]));
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

struct NearPair {
  double distance2;
  std::uint32_t a, b;  // a < b
};

// Finds the pairs of corners within a distance, the nearest pairs first, by a grid whose cells are as wide as this
// distance.
class NearCorners {
 public:
  NearCorners(const TriangleSoup& soup, const std::vector<std::uint32_t>& corners, double within)
      : soup_(soup), within_(within) {
    for (const std::uint32_t corner : corners) cells_.emplace_back(cell_of(soup.vertices[corner]), corner);
    std::sort(cells_.begin(), cells_.end());
  }

  // Compares a corner with at most kMost corners of a larger index in each cell. This is enough to join all corners of
  // a cell through each other, and the time remains linear if thousands of corners are within the tolerance.
  [[nodiscard]] std::vector<NearPair> pairs() const {
    std::vector<NearPair> found;
    for (const auto& [cell, corner] : cells_) {
      for (std::int64_t k = 0; k < 27; ++k) {
        const Cell beside{cell[0] + k / 9 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k % 3 - 1};
        auto at = std::lower_bound(cells_.begin(), cells_.end(), std::pair(beside, corner + 1));
        for (int looked = 0; at != cells_.end() && at->first == beside && looked < kMost; ++at, ++looked) {
          const double d2 = (soup_.vertices[at->second] - soup_.vertices[corner]).squaredNorm();
          if (d2 <= within_ * within_) found.push_back({d2, corner, at->second});
        }
      }
    }
    std::sort(found.begin(), found.end(), [](const NearPair& p, const NearPair& q) {
      return std::tie(p.distance2, p.a, p.b) < std::tie(q.distance2, q.a, q.b);
    });
    return found;
  }

 private:
  static constexpr int kMost = 64;
  using Cell = std::array<std::int64_t, 3>;
  [[nodiscard]] Cell cell_of(const Vec3& x) const {
    // Coordinates are up to 1e9 m (TriangleMesh). So with cells of at least 1e-9 m, the numbers of cells are up to 1e18
    // and don't overflow.
    const double size = std::max(within_, 1e-9);
    return {static_cast<std::int64_t>(std::floor(x.x() / size)), static_cast<std::int64_t>(std::floor(x.y() / size)),
            static_cast<std::int64_t>(std::floor(x.z() / size))};
  }

  const TriangleSoup& soup_;
  double within_;
  std::vector<std::pair<Cell, std::uint32_t>> cells_;
};

// Sets of corners that have become one corner: union-find, with the box and the triangles of each set.
class Sets {
 public:
  Sets(const TriangleSoup& soup, double within)
      : soup_(soup), within_(within), parent_(soup.vertices.size()), boxes_(soup.vertices.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (std::size_t v = 0; v < boxes_.size(); ++v) boxes_[v] = {soup.vertices[v], soup.vertices[v]};
    triangles_.resize(soup.vertices.size());
    for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
      for (const std::uint32_t v : soup.triangles[t]) triangles_[v].push_back(t);
    }
  }

  // Returns the least index in the set of v.
  [[nodiscard]] std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    if (b < a) std::swap(a, b);
    const Bounds box{boxes_[a].low.cwiseMin(boxes_[b].low), boxes_[a].high.cwiseMax(boxes_[b].high)};
    if ((box.high - box.low).norm() > within_ || share_a_triangle(a, b)) return;
    parent_[b] = a;
    boxes_[a] = box;
    if (triangles_[a].size() < triangles_[b].size()) std::swap(triangles_[a], triangles_[b]);
    triangles_[a].insert(triangles_[a].end(), triangles_[b].begin(), triangles_[b].end());
    triangles_[b].clear();
  }

 private:
  // Whether a triangle has corners in both sets. Triangles smaller than the tolerance don't count.
  [[nodiscard]] bool share_a_triangle(std::uint32_t a, std::uint32_t b) {
    if (triangles_[b].size() < triangles_[a].size()) std::swap(a, b);
    return std::any_of(triangles_[a].begin(), triangles_[a].end(), [&](std::uint32_t t) {
      const Corners& corners = soup_.triangles[t];
      return std::any_of(corners.begin(), corners.end(), [&](std::uint32_t v) { return root(v) == b; }) && !small(t);
    });
  }
  [[nodiscard]] bool small(std::uint32_t t) const {
    const Corners& c = soup_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      if ((soup_.vertices[c[(k + 1) % 3]] - soup_.vertices[c[k]]).norm() > within_) return false;
    }
    return true;
  }

  const TriangleSoup& soup_;
  double within_;
  std::vector<std::uint32_t> parent_;
  std::vector<Bounds> boxes_;
  std::vector<std::vector<std::uint32_t>> triangles_;  // the triangles of each root's set
};

}  // namespace

WeldedCorners weld_borders(TriangleSoup& soup, double within_m) {
  WeldedCorners welded;
  if (!(within_m > 0.0)) return welded;
  const std::vector<std::uint32_t> borders = border_corners(soup);
  const std::vector<NearPair> pairs = NearCorners(soup, borders, within_m).pairs();
  if (pairs.empty()) return welded;
  Sets sets(soup, within_m);
  for (const NearPair& pair : pairs) sets.join(pair.a, pair.b);
  for (const std::uint32_t v : borders) {
    const std::uint32_t root = sets.root(v);
    if (root == v) continue;
    ++welded.corners;
    welded.apart_m = std::max(welded.apart_m, (soup.vertices[v] - soup.vertices[root]).norm());
  }
  for (Corners& t : soup.triangles) {
    for (std::uint32_t& v : t) v = sets.root(v);
  }
  welded.collapsed =
      std::erase_if(soup.triangles, [](const Corners& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  return welded;
}

namespace {

// Turns the faces whose front may be chosen (`free`), so that their fronts agree with those of their neighbours.
class Fronts {
 public:
  Fronts(TriangleSoup& soup, const std::vector<bool>& free) : soup_(soup), free_(free), done_(free.size(), false) {
    for (std::uint32_t f = 0; f < soup.triangles.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        edges_.emplace_back(edge_key(soup.triangles[f][k], soup.triangles[f][(k + 1) % 3]), f);
      }
    }
    std::sort(edges_.begin(), edges_.end());
  }

  void choose() {
    // Starts from faces with a fixed front. Then treats the parts that have no such face.
    for (std::uint32_t f = 0; f < done_.size(); ++f) {
      if (!free_[f] && !done_[f]) (void)spread(f);
    }
    for (std::uint32_t f = 0; f < done_.size(); ++f) {
      if (done_[f]) continue;
      const std::vector<std::uint32_t> part = spread(f);
      double volume = 0.0;
      const Vec3& origin = soup_.vertices[soup_.triangles[f][0]];
      for (const std::uint32_t face : part) {
        const auto& [a, b, c] = soup_.triangles[face];
        volume += (soup_.vertices[a] - origin).dot((soup_.vertices[b] - origin).cross(soup_.vertices[c] - origin));
      }
      if (!(volume < 0.0)) continue;
      for (const std::uint32_t face : part) turn(face);
    }
  }

 private:
  void turn(std::uint32_t f) { std::swap(soup_.triangles[f][1], soup_.triangles[f][2]); }
  [[nodiscard]] bool forth(std::uint32_t f, std::uint32_t a, std::uint32_t b) const {
    const Corners& t = soup_.triangles[f];
    return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
  }

  // Walks from a face over edges with two faces, and turns the free faces that it reaches. Returns the faces of the
  // walk.
  std::vector<std::uint32_t> spread(std::uint32_t from) {
    std::vector<std::uint32_t> part{from};
    done_[from] = true;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const std::uint32_t f = part[next];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = soup_.triangles[f][k], b = soup_.triangles[f][(k + 1) % 3];
        const auto at = std::lower_bound(edges_.begin(), edges_.end(), std::pair(edge_key(a, b), 0u));
        if (edges_.end() - at < 2 || at[1].first != at[0].first) continue;
        if (edges_.end() - at > 2 && at[2].first == at[0].first) continue;
        const std::uint32_t other = at[0].second == f ? at[1].second : at[0].second;
        if (done_[other] || !free_[other]) continue;
        if (forth(other, a, b)) turn(other);
        done_[other] = true;
        part.push_back(other);
      }
    }
    return part;
  }

  TriangleSoup& soup_;
  const std::vector<bool>& free_;
  std::vector<bool> done_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges_;
};

// Returns the three corners sorted, and whether the sorting turned the front.
std::pair<Corners, bool> in_order(Corners t) noexcept {
  bool turned = false;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (t[i] <= t[j]) return;
    std::swap(t[i], t[j]);
    turned = !turned;
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return {t, turned};
}

// The first face with three given corners, and the first face with the same corners and the opposite front, if one
// exists.
struct SameCorners {
  std::uint32_t face;
  std::optional<std::uint32_t> opposite;
};

// Returns, for each set of corners, whether its two faces with opposite fronts belong to a separate surface: a
// connected surface that has no edge in common with a face that has only one front. A wall between two bodies that
// touch isn't a separate surface: each body needs its side of the wall.
std::vector<bool> surfaces_on_their_own(const TriangleSoup& soup, const std::vector<SameCorners>& all) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges;
  for (std::uint32_t s = 0; s < all.size(); ++s) {
    const Corners& t = soup.triangles[all[s].face];
    for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(edge_key(t[k], t[(k + 1) % 3]), s);
  }
  std::sort(edges.begin(), edges.end());
  std::vector<std::uint32_t> parent(all.size());
  std::iota(parent.begin(), parent.end(), 0u);
  std::vector<bool> own(all.size(), true);
  const auto root = [&](std::uint32_t s) {
    while (parent[s] != s) s = parent[s] = parent[parent[s]];
    return s;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    own[b] = own[a] && own[b];
    parent[a] = b;
  };
  for (std::size_t first = 0, k = 0; k < edges.size(); ++k) {
    if (edges[k].first != edges[first].first) first = k;
    join(edges[k].second, edges[first].second);
    if (!all[edges[k].second].opposite) own[root(edges[k].second)] = false;
  }
  for (std::uint32_t s = 0; s < all.size(); ++s) own[s] = own[root(s)] && all[s].opposite;
  return own;
}

}  // namespace

RepeatedFaces leave_out_repeated(TriangleSoup& soup) {
  // For each face: the sorted corners, the index, and whether sorting turned the face's front.
  std::vector<std::tuple<Corners, std::uint32_t, bool>> faces;
  faces.reserve(soup.triangles.size());
  for (std::uint32_t f = 0; f < soup.triangles.size(); ++f) {
    const auto [corners, turned] = in_order(soup.triangles[f]);
    faces.emplace_back(corners, f, turned);
  }
  std::sort(faces.begin(), faces.end());
  RepeatedFaces repeated;
  std::vector<SameCorners> all;
  std::vector<bool> out(faces.size(), false), free(faces.size(), false);
  for (std::size_t first = 0, k = 0; k < faces.size(); ++k) {
    const auto& [corners, face, turned] = faces[k];
    if (k == 0 || corners != std::get<0>(faces[first])) {
      first = k;
      all.push_back({face, {}});
    } else if (turned != std::get<2>(faces[first]) && !all.back().opposite) {
      all.back().opposite = face;
    } else {
      out[face] = true;
      ++repeated.same;
    }
  }
  if (all.size() == faces.size()) return repeated;
  const std::vector<bool> own = surfaces_on_their_own(soup, all);
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (!own[s]) continue;
    out[*all[s].opposite] = true;
    free[all[s].face] = true;
    ++repeated.opposite;
  }
  if (repeated.same + repeated.opposite == 0) return repeated;
  TriangleSoup kept;
  std::vector<bool> free_kept;
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (out[f]) continue;
    kept.triangles.push_back(soup.triangles[f]);
    free_kept.push_back(free[f]);
  }
  soup.triangles = std::move(kept.triangles);
  if (repeated.opposite > 0) Fronts(soup, free_kept).choose();
  return repeated;
}

double default_weld(double largest_coordinate, double last_digit) noexcept {
  const double digit = std::min(last_digit, std::ldexp(largest_coordinate, -10));
  return std::max(std::ldexp(largest_coordinate, -16), 1.75 * digit);
}

}  // namespace proxarm::models
