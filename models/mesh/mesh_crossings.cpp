#include "models/mesh/mesh_crossings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "models/mesh/mesh_near_pairs.hpp"

namespace proxarm::models {
namespace {

using Place = std::optional<Vec3>;

// The heights of one face's corners over the plane of another face.
struct Beside {
  int above = 0, below = 0;
  int on = 0;           // corners in the plane
  std::size_t off = 0;  // a corner that isn't in the plane

  double most = 0.0;  // largest |height|, m
  [[nodiscard]] bool both_sides() const noexcept { return above > 0 && below > 0; }
  [[nodiscard]] bool edge_in_plane() const noexcept { return on == 2; }
  // Whether the face meets the plane in at most one point.
  [[nodiscard]] bool clear() const noexcept { return most > kSheet_m && on < 2 && !both_sides(); }
};

// The directions from a line to the two faces beside an edge that lies in this line.
using Wedge = std::array<Vec3, 2>;

// Whether two wedges about one line cross: the two faces of one wedge are on different sides of the other wedge.
bool cross_about(const Vec3& line, const Wedge& a, const Wedge& b) noexcept {
  const Vec3 u = a[0].normalized(), v = line.cross(u);
  const auto angle = [&](const Vec3& x) {
    const double at = std::atan2(v.dot(x), u.dot(x));
    return at < 0.0 ? at + 2.0 * std::numbers::pi : at;
  };
  const double opening = angle(a[1]);
  return (angle(b[0]) < opening) != (angle(b[1]) < opening);
}

Vec3 across(const Vec3& from, const Vec3& line, const Vec3& to) noexcept {
  return (to - from) - line.dot(to - from) * line;
}

// Tests whether two faces of a mesh cross or lie on one another, and finds the place.
class FacePairs {
 public:
  explicit FacePairs(const TriangleMesh& mesh)
      : mesh_(mesh), crossing_(std::max(kCrossing_m, mesh.lift_m())), sheet_(std::max(kSheet_m, crossing_)) {}

  [[nodiscard]] Place place(std::uint32_t f, std::uint32_t g) const {
    if (std::isinf(mesh_.face(f).trust) || std::isinf(mesh_.face(g).trust)) return {};
    int shared = 0;
    for (const std::uint32_t v : mesh_.triangle(g)) shared += has(f, v) ? 1 : 0;
    if (shared == 3) return middle(f);
    if (shared == 2) return folded(f, g) ? Place(middle(g)) : std::nullopt;
    const Beside g_to_f = beside(f, g);
    if (g_to_f.clear()) return {};
    const Beside f_to_g = beside(g, f);
    if (f_to_g.clear()) return {};
    if (std::min(g_to_f.most, f_to_g.most) <= sheet_) {
      const bool in_f = g_to_f.most <= f_to_g.most;
      return overlap(in_f ? f : g, in_f ? g : f) ? Place(middle(in_f ? g : f)) : std::nullopt;
    }
    if (g_to_f.both_sides() && f_to_g.both_sides()) return cut(f, g);
    if (g_to_f.edge_in_plane()) return passed(f, g, g_to_f.off);
    return f_to_g.edge_in_plane() ? passed(g, f, f_to_g.off) : std::nullopt;
  }

 private:
  [[nodiscard]] bool has(std::uint32_t f, std::uint32_t vertex) const noexcept {
    const auto& t = mesh_.triangle(f);
    return vertex == t[0] || vertex == t[1] || vertex == t[2];
  }
  [[nodiscard]] Vec3 middle(std::uint32_t f) const noexcept {
    return (mesh_.corner(f, 0) + mesh_.corner(f, 1) + mesh_.corner(f, 2)) / 3.0;
  }
  [[nodiscard]] Vec3 side(std::uint32_t f, std::size_t k) const noexcept {
    return mesh_.corner(f, (k + 1) % 3) - mesh_.corner(f, k);
  }

  [[nodiscard]] Beside beside(std::uint32_t f, std::uint32_t g) const noexcept {
    Beside found;
    for (std::size_t k = 0; k < 3; ++k) {
      const double h = has(f, mesh_.triangle(g)[k]) ? 0.0 : TriangleMesh::height(mesh_.face(f), mesh_.corner(g, k));
      found.above += h > crossing_ ? 1 : 0;
      found.below += h < -crossing_ ? 1 : 0;
      found.on += std::abs(h) <= crossing_ ? 1 : 0;
      if (std::abs(h) > crossing_) found.off = k;
      found.most = std::max(found.most, std::abs(h));
    }
    return found;
  }

  // Whether two faces that share an edge lie on one another.
  [[nodiscard]] bool folded(std::uint32_t f, std::uint32_t g) const noexcept {
    return std::min(beside(f, g).most, beside(g, f).most) <= sheet_ && overlap(f, g);
  }

  // Returns the length (m) by which the projections of two faces onto a direction overlap.
  [[nodiscard]] double overlap_along(const Vec3& unit, std::uint32_t f, std::uint32_t g) const noexcept {
    const Vec3& origin = mesh_.corner(f, 0);
    const auto shadow = [&](std::uint32_t face) {
      const double a = unit.dot(mesh_.corner(face, 0) - origin), b = unit.dot(mesh_.corner(face, 1) - origin),
                   c = unit.dot(mesh_.corner(face, 2) - origin);
      return std::pair(std::min({a, b, c}), std::max({a, b, c}));
    };
    const auto [low_f, high_f] = shadow(f);
    const auto [low_g, high_g] = shadow(g);
    return std::min(high_f - low_g, high_g - low_f);
  }

  // Whether two faces overlap in the plane of f. Tests this by the separating-axis theorem: convex polygons are apart
  // if and only if one of their sides separates them.
  [[nodiscard]] bool overlap(std::uint32_t f, std::uint32_t g) const noexcept {
    const Vec3& n = mesh_.face(f).normal;
    for (const std::uint32_t of : {f, g}) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 axis = n.cross(side(of, k));
        if (const double size = axis.norm(); size > 0.0 && !(overlap_along(axis / size, f, g) > sheet_)) return false;
      }
    }
    return true;
  }

  // Returns the place where one face goes through the other face. Whether it does is decided exactly; the place is
  // returned only if the depth exceeds rounding. The depth is the length of the shortest move that separates the faces,
  // along a normal or perpendicular to an edge of each face. (If the edges are nearly parallel, the direction
  // perpendicular to both is rounded. This does no harm, because any direction can prove that the faces are apart.)
  [[nodiscard]] Place cut(std::uint32_t f, std::uint32_t g) const noexcept {
    Place at = cut_by_edge(f, g);
    if (!at) at = cut_by_edge(g, f);
    for (std::size_t k = 0; k < 3 && at; ++k) {
      for (std::size_t l = 0; l < 3 && at; ++l) {
        const Vec3 axis = side(f, k).cross(side(g, l));
        if (const double size = axis.norm(); size > 0.0 && !(overlap_along(axis / size, f, g) > crossing_)) at.reset();
      }
    }
    return at;
  }
  [[nodiscard]] Place cut_by_edge(std::uint32_t f, std::uint32_t g) const noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (has(f, mesh_.triangle(g)[k]) || has(f, mesh_.triangle(g)[next])) continue;
      const Vec3 &x = mesh_.corner(g, k), &y = mesh_.corner(g, next);
      if (!mesh_.touched_by(f, x, y)) continue;
      const double from = TriangleMesh::height(mesh_.face(f), x), to = TriangleMesh::height(mesh_.face(f), y);
      return from == to ? x : x + std::clamp(from / (from - to), 0.0, 1.0) * (y - x);
    }
    return {};
  }

  // Precondition: the edge of g opposite the corner `off` lies in the plane of f. Returns the place where the surface
  // of g continues beyond this edge on the other side of f. If the edge of g lies on an edge of f, the two faces beside
  // this edge of f replace f.
  [[nodiscard]] Place passed(std::uint32_t f, std::uint32_t g, std::size_t off) const noexcept {
    const std::size_t k = (off + 1) % 3;
    const Vec3 &from = mesh_.corner(g, k), &to = mesh_.corner(g, (k + 1) % 3);
    const double length = (to - from).norm();
    const Vec3 line = (to - from) / length;
    const auto wedge = [&](std::uint32_t face, std::size_t edge) -> std::optional<Wedge> {
      const std::optional<Vec3> other = apex_beyond(face, edge);
      if (!other) return {};
      return Wedge{across(from, line, mesh_.corner(face, (edge + 2) % 3)), across(from, line, *other)};
    };
    const std::optional<Wedge> own = wedge(g, k);
    if (!own) return {};
    if (const Piece in = inside(f, from, line, length); in.high - in.low > crossing_) {
      const Vec3 flat = mesh_.face(f).normal.cross(line);
      return cross_about(line, *own, {flat, -flat}) ? Place(from + 0.5 * (in.low + in.high) * line) : std::nullopt;
    }
    for (std::size_t edge = 0; edge < 3; ++edge) {
      const Piece on = on_side(f, edge, from, line, length);
      if (!(on.high - on.low > crossing_)) continue;
      const std::optional<Wedge> other = wedge(f, edge);
      if (other && cross_about(line, *own, *other)) return from + 0.5 * (on.low + on.high) * line;
    }
    return {};
  }

  // A piece of a line. Its ends are distances from the line's first point, m.
  struct Piece {
    double low, high;
  };
  // Returns the unit direction across side k into the face.
  [[nodiscard]] Vec3 inwards(std::uint32_t f, std::size_t k) const noexcept {
    return mesh_.face(f).normal.cross(side(f, k)).normalized();
  }
  // Returns the piece of a line in the face's plane that is inside the face and on none of the face's sides.
  [[nodiscard]] Piece inside(std::uint32_t f, const Vec3& from, const Vec3& line, double length) const noexcept {
    Piece piece{0.0, length};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 in = inwards(f, k);
      const double start = in.dot(from - mesh_.corner(f, k)) - crossing_, rise = in.dot(line);
      if (start <= 0.0 && start + rise * length <= 0.0) return {0.0, 0.0};
      if (start < 0.0) piece.low = std::max(piece.low, -start / rise);
      if (start + rise * length < 0.0) piece.high = std::min(piece.high, -start / rise);
    }
    return piece;
  }
  // Returns the piece of a line that is on side k of the face.
  [[nodiscard]] Piece on_side(std::uint32_t f, std::size_t k, const Vec3& from, const Vec3& line,
                              double length) const noexcept {
    const Vec3 in = inwards(f, k), start = mesh_.corner(f, k) - from, end = start + side(f, k);
    if (std::abs(in.dot(start)) > crossing_ || std::abs(in.dot(start - length * line)) > crossing_) return {0.0, 0.0};
    return {std::max(0.0, std::min(line.dot(start), line.dot(end))),
            std::min(length, std::max(line.dot(start), line.dot(end)))};
  }

  // Returns the opposite corner of the face on the other side of edge k, or nullopt unless exactly one other face has
  // this edge.
  [[nodiscard]] std::optional<Vec3> apex_beyond(std::uint32_t f, std::size_t k) const noexcept {
    const std::uint32_t a = mesh_.triangle(f)[k], b = mesh_.triangle(f)[(k + 1) % 3];
    std::optional<Vec3> apex;
    bool one = true;
    mesh_.within(0.5 * (mesh_.vertex(a) + mesh_.vertex(b)), crossing_, [&](std::uint32_t other) {
      if (other == f || !has(other, a) || !has(other, b)) return true;
      one = !apex;
      for (const std::uint32_t v : mesh_.triangle(other)) {
        if (v != a && v != b) apex = mesh_.vertex(v);
      }
      return one;
    });
    return one ? apex : std::nullopt;
  }

  const TriangleMesh& mesh_;
  double crossing_, sheet_;
};

}  // namespace

std::optional<Vec3> crossing_at(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g) {
  return FacePairs(mesh).place(f, g);
}

MeshDefect find_crossing_faces(const TriangleMesh& mesh, std::size_t most) {
  const FacePairs pairs(mesh);
  MeshDefect found;
  std::set<std::pair<std::uint32_t, std::uint32_t>> known;
  each_near_pair(mesh, std::max(kSheet_m, mesh.lift_m()), [&](std::uint32_t f, std::uint32_t g) {
    const Place at = pairs.place(f, g);
    if (at && known.emplace(f, g).second && found.count++ == 0) found.first_W = *at;
    return found.count < most;
  });
  return found;
}

MeshDefect crossing_faces(const TriangleMesh& mesh) {
  return mesh.crossings([&mesh] { return find_crossing_faces(mesh, kMostCrossings); });
}

}  // namespace proxarm::models
