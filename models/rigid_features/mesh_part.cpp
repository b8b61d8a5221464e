#include "models/rigid_features/mesh_part.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace proxarm::models {
namespace {

std::shared_ptr<const TriangleFeatures> features_of(TriangleSoup soup) {
  try {
    return std::make_shared<const TriangleFeatures>(std::make_shared<const TriangleMesh>(std::move(soup)));
  } catch (const std::invalid_argument& problem) {
    throw std::invalid_argument(std::string("a mesh as a tool can't have ") + problem.what());
  }
}

Solid solid_of(const TriangleFeatures& features) {
  const TriangleMesh& mesh = features.mesh();
  Solid solid;
  solid.points = mesh.structure().vertices;
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const TriangleMesh::Face& face = mesh.face(f);
    solid.faces.push_back({face.normal, face.normal.dot(face.corner), 3 * f, 3});
    for (const std::uint32_t corner : mesh.triangle(f)) solid.ring.push_back(corner);
  }
  for (std::uint32_t e = 0; e < features.edges(); ++e) {
    const auto& [from, to] = features.ends(e);
    solid.edges.push_back({from, to, features.edge(e).line.left, features.edge(e).line.right});
  }
  for (const Vec3& p : solid.points) solid.reach = std::max(solid.reach, p.norm());
  return solid;
}

// Returns the distance from a place on a face, straight through the body, to the opposite face. If that face doesn't
// look the other way, the place is beside a ridge; this isn't a wall, and the result is the diagonal of the mesh's box.
double thickness_at(const TriangleMesh& mesh, std::uint32_t face, const Vec3& place) {
  constexpr double most_cosine = -0.5;
  const Vec3 normal = mesh.face(face).normal, inside = place - 16.0 * mesh.lift_m() * normal;
  const double far = (mesh.bounds().high - mesh.bounds().low).norm();
  const TriangleMesh::Hit hit = mesh.first_hit(inside, inside - far * normal);
  const bool is_wall = hit.any() && normal.dot(mesh.face(hit.face).normal) < most_cosine;
  return is_wall ? hit.share * far : far;
}

// Returns the thickness of the thinnest wall. The thickness at a face is the largest thickness at four of the face's
// places. So a wall that ends in a sharp edge counts with its thickness beside the edge.
double thickness(const TriangleMesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    const Vec3 middle = (mesh.corner(f, 0) + mesh.corner(f, 1) + mesh.corner(f, 2)) / 3.0;
    double most = thickness_at(mesh, f, middle);
    for (const std::size_t k : {0U, 1U, 2U}) {
      most = std::max(most, thickness_at(mesh, f, 0.2 * middle + 0.8 * mesh.corner(f, k)));
    }
    least = std::min(least, most);
  }
  return least;
}

}  // namespace

MeshPart mesh_part(const MeshTool& shape, const Pose& X) {
  TriangleSoup soup;
  soup.triangles = shape.triangles;
  for (const Vec3& p : shape.points_m) soup.vertices.push_back(X * p);
  MeshPart part;
  part.features = features_of(soup);
  if (!part.features->mesh().closed()) throw std::invalid_argument("a mesh as a tool must be closed");
  if (part.features->outwards() < 0.0) {
    for (auto& triangle : soup.triangles) std::swap(triangle[0], triangle[1]);
    part.features = features_of(std::move(soup));
  }
  part.solid = solid_of(*part.features);
  part.thickness_m = thickness(part.features->mesh());
  return part;
}

}  // namespace proxarm::models
