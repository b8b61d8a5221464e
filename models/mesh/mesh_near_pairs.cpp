#include "models/mesh/mesh_near_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace proxarm::models {
namespace {

using Visit = std::function<bool(std::uint32_t, std::uint32_t)>;
using Faces = std::vector<std::uint32_t>;

// A node of the tree: the index of its pair, and its index within the pair.
struct Node {
  std::uint32_t pair, of;
  [[nodiscard]] bool operator==(const Node&) const = default;
};

// The box of a face, in float. It is so wide that faces whose boxes don't meet are farther apart than `margin`.
struct Box {
  std::array<float, 3> low, high;
};

std::vector<Box> boxes_of(const TriangleMesh& mesh, double margin) {
  std::vector<Box> boxes(mesh.size());
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const Vec3 &a = mesh.corner(f, 0), &b = mesh.corner(f, 1), &c = mesh.corner(f, 2);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const double low = std::min({a[i], b[i], c[i]}) - margin, high = std::max({a[i], b[i], c[i]}) + margin;
      boxes[f].low[k] = std::nextafter(static_cast<float>(low), -std::numeric_limits<float>::infinity());
      boxes[f].high[k] = std::nextafter(static_cast<float>(high), std::numeric_limits<float>::infinity());
    }
  }
  return boxes;
}

bool meet(const Box& a, const Box& b) noexcept {
  return a.low[0] <= b.high[0] && b.low[0] <= a.high[0] && a.low[1] <= b.high[1] && b.low[1] <= a.high[1] &&
         a.low[2] <= b.high[2] && b.low[2] <= a.high[2];
}

// Calls visit(f, g) for all pairs of faces whose boxes meet. Returns false if there are more than `most` pairs, or if
// visit() returns false.
template <typename Meeting>
bool walk_tree(const TriangleMesh& mesh, const std::vector<Box>& boxes, double margin, std::size_t most,
               Meeting visit) {
  const auto& nodes = mesh.structure().nodes;
  const auto count = [&nodes](Node n) { return nodes[n.pair].count[n.of]; };
  const auto first = [&nodes](Node n) { return nodes[n.pair].first[n.of]; };
  const auto apart = [&](Node a, Node b) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (nodes[a.pair].low(a.of, k) > nodes[b.pair].high(b.of, k) + margin) return true;
      if (nodes[b.pair].low(b.of, k) > nodes[a.pair].high(a.of, k) + margin) return true;
    }
    return false;
  };
  std::vector<std::pair<Node, Node>> waiting{{{0, 0}, {0, 0}}};
  while (!waiting.empty()) {
    const auto [a, b] = waiting.back();
    waiting.pop_back();
    const bool same = a == b;
    if (!same && apart(a, b)) continue;
    if (count(a) > 0 && count(b) > 0) {
      for (std::uint32_t f = first(a); f < first(a) + count(a); ++f) {
        for (std::uint32_t g = same ? f + 1 : first(b); g < first(b) + count(b); ++g) {
          if (!meet(boxes[f], boxes[g])) continue;
          if (most-- == 0 || !visit(std::min(f, g), std::max(f, g))) return false;
        }
      }
      continue;
    }
    // An inner node is replaced by its two children. If a node is paired with itself, the new pairs are each child with
    // itself and one child with the other child.
    const std::uint32_t of_a = count(a) > 0 ? 1 : 2, of_b = count(b) > 0 ? 1 : 2;
    for (std::uint32_t i = 0; i < of_a; ++i) {
      for (std::uint32_t j = same ? i : 0; j < of_b; ++j) {
        waiting.emplace_back(of_a == 1 ? a : Node{first(a), i}, of_b == 1 ? b : Node{first(b), j});
      }
    }
  }
  return true;
}

// A box that is a part of space.
struct Cell {
  Vec3 low, high;
};

// Divides space into cells, recursively, as long as this reduces the number of pairs of faces that share a cell.
//
// All faces that contain one vertex v, the fan of v, share the cell around v, however small the cell is. The rim of
// such a face is its edge opposite v. Two faces of the fan need no test in a cell that neither face's rim enters, for
// these reasons:
// 1. If two triangles share the corner v and a point that isn't a corner of both, they share a piece of a ray from v,
//    because triangles are convex. The triangle that ends first along this ray ends at its rim. So the triangles meet
//    at a point of a rim.
// 2. If two triangles share two corners v and w and overlap in a plane, they meet at a point that is on the rim of one
//    triangle for the fan of v, and on the rim of one triangle for the fan of w. This point is where the ray from v
//    along a side of one triangle leaves the other triangle, or a corner of one triangle within the other triangle. So
//    v or w may be chosen for the fan.
// 3. If two triangles share three corners, they are the same face twice; twins() visits them.
// 4. Faces that are within near_m of one another's plane are projected onto this plane, and steps 1 to 3 hold for the
//    projections.
//
// Therefore a cell is extended by 2 near_m on all sides: by near_m for the distance in step 4, and by near_m for
// rounding. (Rounding is a few u times the largest coordinate S, and near_m is at least lift_m(), which is 64 u S.)
class CellSearch {
 public:
  CellSearch(const TriangleMesh& mesh, const std::vector<Box>& boxes, double near_m, const Visit& visit)
      : mesh_(mesh), boxes_(boxes), margin_(2.0 * near_m), visit_(visit) {}

  void run() {
    Faces all;
    for (std::uint32_t f = 0; f < mesh_.size(); ++f) {
      if (!std::isinf(mesh_.face(f).trust)) all.push_back(f);
    }
    if (twins(all)) search(part_of({mesh_.bounds().low, mesh_.bounds().high}, std::move(all)), kCredit);
  }

 private:
  static constexpr double kLess = 0.8, kCredit = 4.0;

  // The interval along an axis that is covered by the piece of a face within a cell.
  struct Shadow {
    double low, high;
    std::uint32_t face;
  };
  using Shadows = std::vector<Shadow>;  // sorted by their lows

  // A cell with the faces that enter it, and the number of pairs to test in this cell.
  struct Part {
    Cell cell;
    Shadows fan, others;  // fan: faces of one fan whose rims don't enter the cell; others: all other faces
    std::size_t pairs = 0;
    [[nodiscard]] std::size_t size() const noexcept { return fan.size() + others.size(); }
  };

  [[nodiscard]] bool meeting(std::uint32_t f, std::uint32_t g) const {
    return !meet(boxes_[f], boxes_[g]) || visit_(std::min(f, g), std::max(f, g));
  }

  // Visits the pairs of faces with the same three corners. Returns false to stop.
  [[nodiscard]] bool twins(const Faces& faces) const {
    std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> corners;
    for (const std::uint32_t f : faces) {
      auto t = mesh_.triangle(f);
      std::sort(t.begin(), t.end());
      corners.emplace_back(t, f);
    }
    std::sort(corners.begin(), corners.end());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      for (std::size_t j = i + 1; j < corners.size() && corners[j].first == corners[i].first; ++j) {
        if (!meeting(corners[i].second, corners[j].second)) return false;
      }
    }
    return true;
  }

  // Tests the pairs of a cell, or divides the cell and searches its parts. Returns false to stop. Each division
  // multiplies `credit` by kLess times the ratio of the pairs before and after the division; `credit` is at most
  // kCredit. A cell is divided only if `credit` is then at least 1. So after n divisions at most kCredit kLessⁿ times
  // the pairs of the whole mesh are left: the recursion ends, and useless divisions cost at most kCredit times the
  // pairs.
  bool search(const Part& part, double credit) const {  // NOLINT(misc-no-recursion): it ends, as above
    constexpr std::size_t few = 8;                      // with fewer pairs for each face, dividing isn't worth its time
    if (part.pairs <= few * part.size()) return look_at(part);
    const std::vector<Part> parts = divided(part);
    double pairs = 0.0;
    for (const Part& child : parts) pairs += static_cast<double>(child.pairs);
    const double left = std::min(kCredit, credit * kLess * static_cast<double>(part.pairs) / std::max(pairs, 1.0));
    if (left < 1.0) return look_at(part);
    return std::all_of(parts.begin(), parts.end(), [&](const Part& child) { return search(child, left); });
  }

  // Tests the pairs whose intervals overlap. If two intervals overlap, the interval with the higher low begins within
  // the interval with the lower low.
  [[nodiscard]] bool look_at(const Part& part) const {
    const auto look = [this](const Shadow& of, auto first, auto last) {
      return std::all_of(first, last, [&](const Shadow& other) { return meeting(of.face, other.face); });
    };
    for (auto at = part.others.begin(); at != part.others.end(); ++at) {
      if (!look(*at, at + 1, beyond(part.others, at->high))) return false;
      if (!look(*at, from(part.fan, at->low), beyond(part.fan, at->high))) return false;
    }
    return std::all_of(part.fan.begin(), part.fan.end(), [&](const Shadow& in_fan) {
      return look(in_fan, beyond(part.others, in_fan.low), beyond(part.others, in_fan.high));
    });
  }
  [[nodiscard]] static std::size_t pairs_of(const Part& part) {
    std::ptrdiff_t pairs = 0;
    for (auto at = part.others.begin(); at != part.others.end(); ++at) {
      pairs += beyond(part.others, at->high) - (at + 1);
      pairs += beyond(part.fan, at->high) - from(part.fan, at->low);
    }
    for (const Shadow& in_fan : part.fan) {
      pairs += beyond(part.others, in_fan.high) - beyond(part.others, in_fan.low);
    }
    return static_cast<std::size_t>(pairs);
  }
  static Shadows::const_iterator from(const Shadows& shadows, double low) {
    return std::lower_bound(shadows.begin(), shadows.end(), low, [](const Shadow& a, double x) { return a.low < x; });
  }
  static Shadows::const_iterator beyond(const Shadows& shadows, double high) {
    return std::upper_bound(shadows.begin(), shadows.end(), high, [](double x, const Shadow& a) { return x < a.low; });
  }

  // Divides a cell into eight, at planes beside the middle because meshes often have corners exactly in the middle.
  [[nodiscard]] std::vector<Part> divided(const Part& part) const {
    const Vec3 share(0.4615, 0.5291, 0.4837);
    const Vec3 middle = part.cell.low + share.cwiseProduct(part.cell.high - part.cell.low);
    std::vector<Part> parts;
    for (unsigned k = 0; k < 8; ++k) {
      Cell cell = part.cell;
      for (Eigen::Index axis = 0; axis < 3; ++axis) ((k >> axis & 1) != 0 ? cell.low : cell.high)[axis] = middle[axis];
      Faces faces;
      for (const Shadows* of : {&part.fan, &part.others}) {
        for (const Shadow& shadow : *of) {
          if (comes_into(shadow.face, cell)) faces.push_back(shadow.face);
        }
      }
      if (faces.size() > 1) parts.push_back(part_of(cell, std::move(faces)));
    }
    return parts;
  }

  [[nodiscard]] Part part_of(const Cell& cell, Faces faces) const {
    const std::uint32_t v = busiest(faces);
    const auto without_rim = [&](std::uint32_t f) {
      const auto& t = mesh_.triangle(f);
      const auto at = static_cast<std::size_t>(std::find(t.begin(), t.end(), v) - t.begin());
      return at < 3 && !edge_comes_into(mesh_.corner(f, (at + 1) % 3), mesh_.corner(f, (at + 2) % 3), cell);
    };
    const auto end = std::partition(faces.begin(), faces.end(), without_rim);
    Shadows all = thinnest_shadows(cell, faces);
    const auto others = all.begin() + (end - faces.begin());
    Part part{cell, {all.begin(), others}, {others, all.end()}};
    const auto lower = [](const Shadow& a, const Shadow& b) { return a.low < b.low; };
    std::sort(part.fan.begin(), part.fan.end(), lower);
    std::sort(part.others.begin(), part.others.end(), lower);
    part.pairs = pairs_of(part);
    return part;
  }

  // Returns the vertex that most of the faces contain.
  [[nodiscard]] std::uint32_t busiest(const Faces& faces) const {
    Faces corners;
    corners.reserve(3 * faces.size());
    for (const std::uint32_t f : faces)
      corners.insert(corners.end(), mesh_.triangle(f).begin(), mesh_.triangle(f).end());
    std::sort(corners.begin(), corners.end());
    std::uint32_t found = 0;
    std::ptrdiff_t most = 0;
    for (auto first = corners.begin(); first != corners.end();) {
      const auto last = std::find_if(first, corners.end(), [first](std::uint32_t v) { return v != *first; });
      if (last - first > most) std::tie(most, found) = std::pair(last - first, *first);
      first = last;
    }
    return found;
  }

  // Whether a face enters a cell, by the separating-axis theorem: a box and a triangle (or an edge) are apart if and
  // only if their projections are apart on an axis of the box, on the triangle's normal, or on an axis perpendicular to
  // an edge of each.
  [[nodiscard]] bool comes_into(std::uint32_t f, const Cell& cell) const noexcept {
    const Vec3 middle = 0.5 * (cell.low + cell.high), half = 0.5 * (cell.high - cell.low) + Vec3::Constant(margin_);
    const std::array<Vec3, 3> at{mesh_.corner(f, 0) - middle, mesh_.corner(f, 1) - middle, mesh_.corner(f, 2) - middle};
    if (boxes_apart<3>(at, half)) return false;
    const Vec3& n = mesh_.face(f).normal;
    if (std::abs(n.dot(at[0])) > half.dot(n.cwiseAbs())) return false;
    for (std::size_t k = 0; k < 3; ++k) {
      if (edges_apart<3>(at, at[(k + 1) % 3] - at[k], half)) return false;
    }
    return true;
  }
  [[nodiscard]] bool edge_comes_into(const Vec3& from, const Vec3& to, const Cell& cell) const noexcept {
    const Vec3 middle = 0.5 * (cell.low + cell.high), half = 0.5 * (cell.high - cell.low) + Vec3::Constant(margin_);
    const std::array<Vec3, 2> at{from - middle, to - middle};
    return !boxes_apart<2>(at, half) && !edges_apart<2>(at, at[1] - at[0], half);
  }
  template <std::size_t N>
  [[nodiscard]] static bool boxes_apart(const std::array<Vec3, N>& at, const Vec3& half) noexcept {
    Vec3 low = at[0], high = at[0];
    for (const Vec3& x : at) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    return (low.array() > half.array()).any() || (high.array() < -half.array()).any();
  }
  template <std::size_t N>
  [[nodiscard]] static bool edges_apart(const std::array<Vec3, N>& at, const Vec3& edge, const Vec3& half) noexcept {
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = Vec3::Unit(k).cross(edge);
      double low = axis.dot(at[0]), high = low;
      for (const Vec3& x : at) {
        low = std::min(low, axis.dot(x));
        high = std::max(high, axis.dot(x));
      }
      const double reach = half.dot(axis.cwiseAbs());
      if (low > reach || high < -reach) return true;
    }
    return false;
  }

  // Returns the faces' intervals along the axis on which they overlap least. Candidates are the coordinate axes, the
  // normals of some faces, and for each of these faces the axis in its plane across its longest edge. In a stack or a
  // fan, the faces are apart along one of these axes.
  [[nodiscard]] Shadows thinnest_shadows(const Cell& cell, const Faces& faces) const {
    const std::vector<Piece> pieces = pieces_of(cell, faces);
    Shadows thinnest = shadows_of(pieces, Vec3::UnitX());
    const auto consider = [&](const Vec3& axis) {
      Shadows shadows = shadows_of(pieces, axis);
      if (crowding(shadows) < crowding(thinnest)) thinnest = std::move(shadows);
    };
    constexpr std::size_t worth_it = 16, some = 6;
    if (faces.size() <= worth_it) return thinnest;
    consider(Vec3::UnitY());
    consider(Vec3::UnitZ());
    for (std::size_t k = 0; k < some; ++k) {
      const std::uint32_t f = faces[k * faces.size() / some];
      consider(mesh_.face(f).normal);
      Vec3 longest = Vec3::Zero();
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 edge = mesh_.corner(f, (i + 1) % 3) - mesh_.corner(f, i);
        if (edge.squaredNorm() > longest.squaredNorm()) longest = edge;
      }
      consider(mesh_.face(f).normal.cross(longest.normalized()));
    }
    return thinnest;
  }

  // The part of a triangle within a cell. It has at most nine corners, because each of the cell's six sides cuts off
  // one corner and makes two.
  struct Piece {
    std::uint32_t face;
    std::size_t count;
    std::array<Vec3, 9> corners;
  };
  [[nodiscard]] std::vector<Piece> pieces_of(const Cell& cell, const Faces& faces) const {
    std::vector<Piece> pieces(faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i) {
      Piece& piece = pieces[i];
      piece.face = faces[i];
      piece.count = 3;
      for (std::size_t k = 0; k < 3; ++k) piece.corners[k] = mesh_.corner(faces[i], k);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        cut(piece, axis, 1.0, cell.high[axis] + margin_);
        cut(piece, axis, -1.0, margin_ - cell.low[axis]);
      }
    }
    return pieces;
  }
  // Keeps the part of the piece with sign · x[axis] ≤ most (Sutherland and Hodgman, 1974), or the whole piece if it has
  // no such part.
  static void cut(Piece& piece, Eigen::Index axis, double sign, double most) noexcept {
    Piece left{piece.face, 0, {}};
    for (std::size_t k = 0; k < piece.count; ++k) {
      const Vec3 &a = piece.corners[k], &b = piece.corners[(k + 1) % piece.count];
      const double over_a = sign * a[axis] - most, over_b = sign * b[axis] - most;
      // Rounding can make the polygon non-convex, and it may then have too many corners.
      if (left.count + 2 > left.corners.size()) return;
      if (over_a <= 0.0) left.corners[left.count++] = a;
      if ((over_a <= 0.0) != (over_b <= 0.0)) left.corners[left.count++] = a + over_a / (over_a - over_b) * (b - a);
    }
    if (left.count > 0) piece = left;
  }

  // Returns the intervals, widened on both sides by half of margin_. This half is near_m, which includes the rounding
  // of the products (see CellSearch).
  [[nodiscard]] Shadows shadows_of(const std::vector<Piece>& pieces, const Vec3& axis) const {
    Shadows shadows;
    shadows.reserve(pieces.size());
    for (const Piece& piece : pieces) {
      double low = axis.dot(piece.corners[0]), high = low;
      for (std::size_t k = 1; k < piece.count; ++k) {
        const double at = axis.dot(piece.corners[k]);
        low = std::min(low, at);
        high = std::max(high, at);
      }
      shadows.push_back({low - 0.5 * margin_, high + 0.5 * margin_, piece.face});
    }
    return shadows;
  }
  // Returns the mean number of intervals that cover a point.
  [[nodiscard]] static double crowding(const Shadows& shadows) noexcept {
    double low = shadows[0].low, high = shadows[0].high, sum = 0.0;
    for (const Shadow& shadow : shadows) {
      low = std::min(low, shadow.low);
      high = std::max(high, shadow.high);
      sum += shadow.high - shadow.low;
    }
    return sum / (high - low);
  }

  const TriangleMesh& mesh_;
  const std::vector<Box>& boxes_;
  double margin_;
  const Visit& visit_;
};

}  // namespace

void each_near_pair(const TriangleMesh& mesh, double near_m, const Visit& visit) {
  // In most meshes, each box meets ten to twenty other boxes.
  constexpr std::size_t many = 64;
  const std::vector<Box> boxes = boxes_of(mesh, near_m);
  bool stopped = false;
  const bool done = walk_tree(mesh, boxes, near_m, many * mesh.size(), [&](std::uint32_t f, std::uint32_t g) {
    stopped = !visit(f, g);
    return !stopped;
  });
  if (!done && !stopped) CellSearch(mesh, boxes, near_m, visit).run();
}

}  // namespace proxarm::models
