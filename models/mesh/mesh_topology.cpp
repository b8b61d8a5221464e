#include "models/mesh/mesh_topology.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "models/mesh/polygon.hpp"

namespace proxarm::models {
namespace {

struct Edge {
  std::uint32_t low, high;  // vertices
  std::uint32_t face;
  bool forth;  // the face traverses the edge from low to high
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> key() const noexcept { return {low, high}; }
};

std::vector<Edge> sorted_edges(const TriangleMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.size());
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const auto& t = mesh.triangle(f);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return std::pair(a.key(), a.face) < std::pair(b.key(), b.face); });
  return edges;
}

// Finds which faces belong to one part, and which faces of a part have the opposite front. Uses union-find, with the
// parity of each face relative to its part's root.
class Parts {
 public:
  explicit Parts(std::size_t faces) : parent_(faces), turned_(faces, false), one_sided_(faces, false) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  struct Root {
    std::uint32_t face;
    bool turned;
  };
  Root root(std::uint32_t face) {
    std::uint32_t at = face;
    bool turned = false;
    while (parent_[at] != at) {
      turned = turned != turned_[at];
      at = parent_[at];
    }
    // Path compression: every face on the path gets the root as its parent.
    for (bool left = turned; parent_[face] != face && face != at;) {
      const std::uint32_t next = parent_[face];
      const bool own = turned_[face];
      parent_[face] = at;
      turned_[face] = left;
      left = left != own;
      face = next;
    }
    return {at, turned};
  }
  // Joins the parts of a and b. `turned`: whether a and b have opposite fronts.
  void join(std::uint32_t a, std::uint32_t b, bool turned) {
    const Root x = root(a), y = root(b);
    if (x.face == y.face) {
      if ((x.turned != y.turned) != turned) one_sided_[x.face] = true;
      return;
    }
    parent_[x.face] = y.face;
    turned_[x.face] = (x.turned != y.turned) != turned;
    one_sided_[y.face] = one_sided_[y.face] || one_sided_[x.face];
  }
  [[nodiscard]] bool one_sided(std::uint32_t root) const { return one_sided_[root]; }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<bool> turned_, one_sided_;
};

Vec3 middle(const TriangleMesh& mesh, std::uint32_t f) {
  return (mesh.corner(f, 0) + mesh.corner(f, 1) + mesh.corner(f, 2)) / 3.0;
}

// Calls visit(first, last) for each edge of the mesh. [first, last) are the entries of this edge in `edges`, one entry
// per face.
template <typename Visit>
void each_edge(const std::vector<Edge>& edges, Visit visit) {
  for (auto first = edges.begin(); first != edges.end();) {
    auto last = first + 1;
    while (last != edges.end() && last->key() == first->key()) ++last;
    visit(first, last);
    first = last;
  }
}

void note(MeshDefect& defect, const Vec3& at_W) {
  if (defect.count++ == 0) defect.first_W = at_W;
}

struct Outlines {
  std::vector<std::vector<std::uint32_t>> loops;   // closed: an edge connects the last vertex to the first vertex
  std::vector<std::vector<std::uint32_t>> chains;  // open: the edges run from the first vertex to the last
};

// Returns the outlines of the edges that have one face. An outline runs against the direction of this face, as the
// faces that would close it do. Chains are walked first, from vertices where more edges begin than end. After that,
// equally many edges begin and end at each vertex, so each walk returns to its start (Euler). A chain ends where
// outlines meet.
Outlines outlines_of(std::vector<std::pair<std::uint32_t, std::uint32_t>> open, std::size_t vertices) {
  std::sort(open.begin(), open.end());
  std::vector<bool> used(open.size(), false);
  std::vector<std::int32_t> more_begin(vertices, 0), ends(vertices, 0);
  std::vector<std::size_t> next(vertices, open.size());  // first edge from each vertex that may be unused
  for (std::size_t k = open.size(); k-- > 0;) {
    const auto [from, to] = open[k];
    next[from] = k;
    ++ends[from];
    ++ends[to];
    ++more_begin[from];
    --more_begin[to];
  }
  const auto next_from = [&](std::uint32_t vertex) {
    std::size_t& at = next[vertex];
    while (at < open.size() && open[at].first == vertex && used[at]) ++at;
    return at < open.size() && open[at].first == vertex ? at : open.size();
  };
  Outlines found;
  const auto take = [&](std::vector<std::uint32_t> chain) {
    const bool loop = chain.front() == chain.back();
    if (loop) chain.pop_back();
    if (!chain.empty()) (loop ? found.loops : found.chains).push_back(std::move(chain));
  };
  const auto walk_chain = [&](std::uint32_t from) {
    std::vector<std::uint32_t> chain{from};
    for (std::size_t at = next_from(from); at < open.size(); at = next_from(open[at].second)) {
      used[at] = true;
      chain.push_back(open[at].second);
      if (ends[chain.back()] > 2) take(std::exchange(chain, {open[at].second}));
    }
    take(std::move(chain));
  };
  for (std::uint32_t vertex = 0; vertex < vertices; ++vertex) {
    for (std::int32_t k = 0; k < more_begin[vertex]; ++k) walk_chain(vertex);
  }
  for (std::size_t first = 0; first < open.size(); ++first) {
    if (used[first]) continue;
    std::vector<std::uint32_t>& loop = found.loops.emplace_back();
    for (std::size_t at = first; at < open.size(); at = next_from(open[at].second)) {
      used[at] = true;
      loop.push_back(open[at].first);
      if (open[at].second == open[first].first) break;
    }
  }
  return found;
}

// Loops with more vertices aren't closed, because this would take too long. The area of such a loop is computed from
// Newell's normal, which takes almost no time.
constexpr std::size_t longest_loop = 2000;

using Cover = std::vector<std::array<std::uint32_t, 3>>;

double area_of(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& corners) {
  const Vec3& a = mesh.vertex(corners[0]);
  return 0.5 * (mesh.vertex(corners[1]) - a).cross(mesh.vertex(corners[2]) - a).norm();
}

double area_of(const TriangleMesh& mesh, const Cover& cover) {
  double area = 0.0;
  for (const auto& triangle : cover) area += area_of(mesh, triangle);
  return area;
}

// Covers a loop by cutting off, again and again, the corner with the smallest triangle. Along a crack these triangles
// are the slivers across the crack. Ear clipping works in a projection, so it can't distinguish these slivers from the
// crack's surroundings.
Cover slivers_first(const TriangleMesh& mesh, std::vector<std::uint32_t> loop) {
  const auto triangle_at = [&loop](std::size_t k) {
    return std::array{loop[(k + loop.size() - 1) % loop.size()], loop[k], loop[(k + 1) % loop.size()]};
  };
  Cover triangles;
  while (loop.size() > 3) {
    std::size_t smallest = 0;
    double smallest_m2 = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const double area_m2 = area_of(mesh, triangle_at(k));
      if (area_m2 < smallest_m2) std::tie(smallest, smallest_m2) = std::pair(k, area_m2);
    }
    triangles.push_back(triangle_at(smallest));
    loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(smallest));
  }
  triangles.push_back(triangle_at(1));
  return triangles;
}

// Returns the smaller of two covers of a loop. A loop of n vertices has many covers of n − 2 triangles, and the
// smallest of all would take long to find.
Cover cover(const TriangleMesh& mesh, const std::vector<std::uint32_t>& loop) {
  Cover ears;
  if (loop.size() < 3) return ears;
  triangulate(mesh.structure().vertices, loop, ears);
  Cover slivers = slivers_first(mesh, loop);
  return area_of(mesh, slivers) < area_of(mesh, ears) ? slivers : ears;
}

double area_over(const TriangleMesh& mesh, const std::vector<std::uint32_t>& loop) {
  if (loop.size() <= longest_loop) return area_of(mesh, cover(mesh, loop));
  Vec3 newell = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    newell += (mesh.vertex(loop[k]) - mesh.vertex(loop[0])).cross(mesh.vertex(loop[k + 1]) - mesh.vertex(loop[0]));
  }
  return 0.5 * newell.norm();
}

MeshHole hole_of(const TriangleMesh& mesh, std::vector<std::uint32_t> loop) {
  MeshHole hole;
  double length = 0.0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    hole.centre += mesh.vertex(loop[k]) / static_cast<double>(loop.size());
    length += (mesh.vertex(loop[(k + 1) % loop.size()]) - mesh.vertex(loop[k])).norm();
  }
  hole.size_m = 4.0 * area_over(mesh, loop) / length;
  hole.loop = std::move(loop);
  return hole;
}

MeshBorder border_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& chain) {
  MeshBorder border{chain.size() - 1, 0.0, Vec3::Zero()};
  for (std::size_t k = 0; k < chain.size(); ++k) {
    border.centre += mesh.vertex(chain[k]) / static_cast<double>(chain.size());
    if (k > 0) border.length_m += (mesh.vertex(chain[k]) - mesh.vertex(chain[k - 1])).norm();
  }
  return border;
}

// Counts the faces whose front is opposite to most faces of their part, and the closed parts that are inside out.
void judge_sides(const TriangleMesh& mesh, Parts& parts, const std::vector<bool>& open_part, MeshTopology& found) {
  struct Part {
    std::size_t faces = 0, turned = 0;
    double volume = 0.0;
  };
  std::vector<Part> of_root(mesh.size());
  const Vec3 origin = mesh.vertex(0);
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const auto [root, turned] = parts.root(f);
    Part& part = of_root[root];
    ++part.faces;
    part.turned += turned ? 1 : 0;
    part.volume += (mesh.corner(f, 0) - origin).dot((mesh.corner(f, 1) - origin).cross(mesh.corner(f, 2) - origin));
  }
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const auto [root, turned] = parts.root(f);
    const Part& part = of_root[root];
    if (!parts.one_sided(root) && turned == (2 * part.turned <= part.faces)) note(found.flipped, middle(mesh, f));
    if (root != f) continue;
    ++found.parts;
    if (parts.one_sided(root)) {
      ++found.one_sided;
    } else if (part.turned == 0 && !open_part[root] && part.volume < 0.0) {
      ++found.inside_out;
    }
  }
}

}  // namespace

MeshTopology topology_of(const TriangleMesh& mesh) {
  MeshTopology found;
  Parts parts(mesh.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
  std::vector<std::uint32_t> open_faces;
  each_edge(sorted_edges(mesh), [&](auto first, auto last) {
    const auto count = last - first;
    if (count == 1) {
      open.emplace_back(first->forth ? first->high : first->low, first->forth ? first->low : first->high);
      open_faces.push_back(first->face);
    } else if (count == 2) {
      parts.join(first->face, (first + 1)->face, first->forth == (first + 1)->forth);
    } else {
      note(found.non_manifold, 0.5 * (mesh.vertex(first->low) + mesh.vertex(first->high)));
    }
  });
  Outlines outlines = outlines_of(std::move(open), mesh.structure().vertices.size());
  for (auto& loop : outlines.loops) found.holes.push_back(hole_of(mesh, std::move(loop)));
  for (const auto& chain : outlines.chains) found.borders.push_back(border_of(mesh, chain));
  std::sort(found.holes.begin(), found.holes.end(),
            [](const MeshHole& a, const MeshHole& b) { return a.size_m < b.size_m; });
  std::sort(found.borders.begin(), found.borders.end(),
            [](const MeshBorder& a, const MeshBorder& b) { return a.length_m < b.length_m; });
  std::vector<bool> open_part(mesh.size(), false);
  for (const std::uint32_t face : open_faces) open_part[parts.root(face).face] = true;
  judge_sides(mesh, parts, open_part, found);
  return found;
}

TriangleSoup with_holes_closed(const TriangleMesh& mesh, double up_to_m) {
  TriangleSoup soup{mesh.structure().vertices, mesh.structure().triangles};
  for (const MeshHole& hole : topology_of(mesh).holes) {
    if (hole.size_m > up_to_m || hole.loop.size() > longest_loop) continue;
    for (const auto& triangle : cover(mesh, hole.loop)) soup.triangles.push_back(triangle);
  }
  return soup;
}

namespace {

NoInside why_crossing(const MeshDefect& found, std::uint64_t closing) {
  const std::string pairs = found.count < kMostCrossings ? (found.count == 1 ? " pair" : " pairs") : " pairs or more";
  const std::string what = "has faces that cross or lie on one another: " + std::to_string(found.count) + pairs +
                           ", the first at " + place_text(found.first_W);
  if (closing > 0) {
    return {what, "close_holes_m has added " + std::to_string(closing) + (closing == 1 ? " triangle" : " triangles") +
                      " over holes, which may be what does: close the hole in the program that made the mesh, and "
                      "where a corner lies on the whole edge of a neighbour, put a corner into that edge as well"};
  }
  return {what,
          "in the program that made it, unite what overlaps and take out folds and sheets of no thickness; bodies that "
          "only touch may be objects of their own"};
}

}  // namespace

NoInside why_no_inside(const TriangleMesh& mesh, std::uint64_t closing) {
  const auto at = [](const MeshDefect& defect) { return ", the first at " + place_text(defect.first_W); };
  if (mesh.closed()) {
    if (mesh.size() < 4) return {"has " + std::to_string(mesh.size()) + " triangles, and the smallest body has 4", ""};
    const MeshDefect found = crossing_faces(mesh);
    return found.count == 0 ? NoInside{} : why_crossing(found, closing);
  }
  const MeshTopology found = topology_of(mesh);
  if (!found.holes.empty()) {
    const MeshHole& largest = found.holes.back();
    if (!(largest.size_m > 0.0)) {
      return {"is open along an edge that faces of one side have whole and those of the other in parts, at " +
                  place_text(largest.centre),
              "its parts need a corner in the whole edge as well"};
    }
    return {"is open, with a hole of " + size_text(largest.size_m) + " at " + place_text(largest.centre),
            "close_holes_m may close it"};
  }
  if (found.non_manifold.count > 0) {
    return {"has edges of three and more faces: " + std::to_string(found.non_manifold.count) + at(found.non_manifold),
            "take out what is inside of it"};
  }
  if (found.flipped.count > 0) {
    return {"has faces turned against the others: " + std::to_string(found.flipped.count) + at(found.flipped),
            "turn them round in the program that made it"};
  }
  return {"has no front that all of its faces agree on", "a body has one"};
}

std::string place_text(const Vec3& at_W) {
  char text[96];
  std::snprintf(text, sizeof text, "x %.4g, y %.4g, z %.4g m", at_W.x(), at_W.y(), at_W.z());
  return text;
}

std::string size_text(double size_m) {
  char text[32];
  if (size_m < 1e-3) {
    std::snprintf(text, sizeof text, "%.3g µm", 1e6 * size_m);
  } else if (size_m < 1.0) {
    std::snprintf(text, sizeof text, "%.3g mm", 1e3 * size_m);
  } else {
    std::snprintf(text, sizeof text, "%.3g m", size_m);
  }
  return text;
}

}  // namespace proxarm::models
