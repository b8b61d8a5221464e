#include "models/rigid_features/rigid_object.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace proxarm::models {
namespace {

// Neighbouring faces count as one plane if their normals differ by less than this angle, rad. If a tool's point is over
// the common edge of such faces, its distance from the edge equals its distance from the faces, to within this share.
constexpr double kFlat = 1e-9;

}  // namespace

TriangleFeatures::TriangleFeatures(std::shared_ptr<const TriangleMesh> mesh) : mesh_(std::move(mesh)) {
  if (mesh_->closed()) outwards_ = front_side();
  if (mesh_->closed()) {
    cones_ = normal_cones(mesh_->structure().vertices.size(), [this](auto visit) {
      for (std::uint32_t f = 0; f < mesh_->size(); ++f) visit(mesh_->face(f).normal, mesh_->triangle(f));
    });
  } else {
    cones_.of_corners.resize(mesh_->structure().vertices.size());
    cones_.around_faces.resize(mesh_->size());
  }
  // All half-edges, sorted so that the half-edges of an edge follow each other.
  struct Half {
    std::uint32_t low, high, face, opposite;
    std::uint8_t bit;
  };
  std::vector<Half> halves;
  const auto faces = static_cast<std::uint32_t>(mesh_->size());
  halves.reserve(3 * static_cast<std::size_t>(faces));
  for (std::uint32_t f = 0; f < faces; ++f) {
    const auto& t = mesh_->triangle(f);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      halves.push_back({std::min(a, b), std::max(a, b), f, t[(k + 2) % 3], static_cast<std::uint8_t>(1U << k)});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& x, const Half& y) {
    return std::tie(x.low, x.high, x.face) < std::tie(y.low, y.high, y.face);
  });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_by_face, vertices_by_face;
  constexpr std::uint32_t none = ~0U;
  std::uint32_t vertices = 0;
  for (const Half& half : halves) vertices = std::max(vertices, half.high + 1);
  std::vector<std::uint32_t> owner(vertices, none);
  bends_.assign(faces, {0, 0});
  for (std::size_t i = 0; i < halves.size();) {
    std::size_t end = i + 1;
    while (end < halves.size() && halves[end].low == halves[i].low && halves[end].high == halves[i].high) ++end;
    if (mesh_->closed() && end - i != 2) throw std::invalid_argument("an edge that more than two faces share");
    const Half& first = halves[i];
    const TriangleMesh::Face& face = mesh_->face(first.face);
    Edge edge;
    edge.line = {mesh_->vertex(first.low), mesh_->vertex(first.high), face.normal, face.normal, end - i != 2};
    bool sharp = end - i != 2;
    if (end - i == 2) {
      edge.line.right = mesh_->face(halves[i + 1].face).normal;
      sharp = edge.line.left.cross(edge.line.right).norm() > kFlat || edge.line.left.dot(edge.line.right) < 0.0;
      edge.ridge = face.normal.dot(mesh_->vertex(halves[i + 1].opposite) - face.corner) < 0.0;
    }
    if (sharp) {
      edges_by_face.emplace_back(first.face, static_cast<std::uint32_t>(edges_.size()));
      edges_.push_back(edge);
      ends_.push_back({first.low, first.high});
      for (std::size_t k = i; k < end && end - i == 2; ++k) bends_[halves[k].face][edge.ridge ? 1 : 0] |= halves[k].bit;
      for (const std::uint32_t v : {first.low, first.high}) {
        if (owner[v] == none) owner[v] = first.face;
      }
    }
    i = end;
  }
  // A vertex must be owned by one of its own faces. The owner of the vertex's first sharp edge is one of them.
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (owner[v] != none) vertices_by_face.emplace_back(owner[v], v);
  }
  const auto sort_out = [faces](auto& by_face, std::vector<std::uint32_t>& owned, std::vector<std::uint32_t>& first) {
    std::sort(by_face.begin(), by_face.end());
    first.assign(faces + 1, 0);
    for (const auto& [face, feature] : by_face) {
      ++first[face + 1];
      owned.push_back(feature);
    }
    for (std::uint32_t f = 0; f < faces; ++f) first[f + 1] += first[f];
  };
  sort_out(edges_by_face, owned_edges_, first_edge_);
  sort_out(vertices_by_face, owned_vertices_, first_vertex_);
}

// Returns 1 if the fronts of the faces are outside, −1 if they are inside. A mesh may consist of several bodies, and a
// body may have hollows: so the largest face of each connected piece is tested. Throws if the pieces disagree.
double TriangleFeatures::front_side() const {
  const auto faces = static_cast<std::uint32_t>(mesh_->size());
  // leads from a vertex to the vertex that represents its piece
  std::vector<std::uint32_t> up(mesh_->structure().vertices.size());
  std::iota(up.begin(), up.end(), 0U);
  const auto piece_of = [&up](std::uint32_t v) {
    while (up[v] != v) v = up[v] = up[up[v]];
    return v;
  };
  const auto area = [this](std::uint32_t f) {
    return (mesh_->corner(f, 1) - mesh_->corner(f, 0)).cross(mesh_->corner(f, 2) - mesh_->corner(f, 0)).norm();
  };
  for (std::uint32_t f = 0; f < faces; ++f) {
    for (const std::size_t k : {1U, 2U}) up[piece_of(mesh_->triangle(f)[k])] = piece_of(mesh_->triangle(f)[0]);
  }
  constexpr std::uint32_t none = ~0U;
  std::vector<std::uint32_t> largest(up.size(), none);
  for (std::uint32_t f = 0; f < faces; ++f) {
    std::uint32_t& best = largest[piece_of(mesh_->triangle(f)[0])];
    if (best == none || area(f) > area(best)) best = f;
  }
  double side = 0.0;
  for (const std::uint32_t f : largest) {
    if (f == none) continue;
    const Vec3 middle = (mesh_->corner(f, 0) + mesh_->corner(f, 1) + mesh_->corner(f, 2)) / 3.0;
    // A point in front of the face, so near that no other face lies between: a millionth of the face's size away, and
    // far above rounding.
    const Vec3 before = middle + std::max(1e-6 * std::sqrt(area(f)), 16.0 * mesh_->lift_m()) * mesh_->face(f).normal;
    const double here = mesh_->encloses(before) ? -1.0 : 1.0;
    if (side != 0.0 && here != side)
      throw std::invalid_argument("faces of which some have their fronts outside, others inside");
    side = here;
  }
  return side;
}

}  // namespace proxarm::models
