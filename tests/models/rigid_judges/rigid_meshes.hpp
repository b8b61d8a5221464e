// Meshes of bodies for rigid tools, and how far convex bodies are from them by the separation from each triangle.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "models/base/random.hpp"
#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"

namespace proxarm::models {

// A ball of 8 n² triangles with bumps of some per cent, as a scan has them.
inline std::shared_ptr<const TriangleMesh> rough_ball(Random& random, double radius, int n) {
  TriangleSoup soup;
  const Vec3 first = 9.0 * random.direction(), second = 17.0 * random.direction();
  // A face of an octahedron after the other, in n² triangles; what they share is welded.
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3 sign((octant & 1) != 0 ? -1.0 : 1.0, (octant & 2) != 0 ? -1.0 : 1.0, (octant & 4) != 0 ? -1.0 : 1.0);
    const auto at = [&](int i, int j) {
      const Vec3 u = sign.cwiseProduct(Vec3(i, j, n - i - j)).normalized();
      soup.vertices.emplace_back(radius * (1.0 + 0.03 * std::sin(first.dot(u)) + 0.02 * std::sin(second.dot(u))) * u);
      return static_cast<std::uint32_t>(soup.vertices.size() - 1);
    };
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (sign.prod() > 0.0) {
        soup.triangles.push_back({a, b, c});
      } else {
        soup.triangles.push_back({a, c, b});
      }
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j < n - 1) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

inline Polyhedron polyhedron_of(const TriangleMesh& mesh, std::uint32_t face) {
  Polyhedron out;
  out.corners = {mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)};
  for (std::size_t k = 0; k < 3; ++k) out.edges.push_back((out.corners[(k + 1) % 3] - out.corners[k]).normalized());
  out.normals.push_back(out.edges[0].cross(out.edges[1]).normalized());
  for (std::size_t k = 0; k < 3; ++k) out.normals.push_back(out.normals[0].cross(out.edges[k]));
  return out;
}

// The separation of convex bodies from a mesh's triangles, of those that may be near.
inline double polyhedra_from_mesh(const std::vector<Polyhedron>& bodies, const std::vector<Polyhedron>& triangles) {
  double least = 1.0;
  for (const Polyhedron& body : bodies) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : body.corners) middle += x / static_cast<double>(body.corners.size());
    double reach = 0.0;
    for (const Vec3& x : body.corners) reach = std::max(reach, (x - middle).norm());
    for (const Polyhedron& triangle : triangles) {
      const double size = std::max((triangle.corners[1] - triangle.corners[0]).norm(),
                                   (triangle.corners[2] - triangle.corners[0]).norm());
      if ((triangle.corners[0] - middle).norm() < reach + size + 1e-3) {
        least = std::min(least, separation(body, triangle));
      }
    }
  }
  return least;
}

inline MeshTool tool_of(const TriangleMesh& mesh) { return {mesh.structure().vertices, mesh.structure().triangles}; }

}  // namespace proxarm::models
