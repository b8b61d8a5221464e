// Meshes for tests and benchmarks.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "models/mesh/mesh.hpp"

namespace proxarm::tests {

// `rings` × `sectors`, radius given by r(θ, φ), about the origin, fronts outside. Each pole is a vertex of `sectors`
// faces. `squeeze` < 1 crowds the rings around the equator: slivers.
template <typename Radius>
models::TriangleSoup globe(std::uint32_t rings, std::uint32_t sectors, Radius radius, double squeeze = 1.0) {
  models::TriangleSoup soup;
  const double pi = std::numbers::pi;
  const auto at = [&](double theta, double phi) {
    const double r = radius(theta, phi);
    soup.vertices.emplace_back(r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi),
                               r * std::cos(theta));
  };
  at(0.0, 0.0);
  for (std::uint32_t i = 1; i < rings; ++i) {
    const double t = 2.0 * i / rings - 1.0;
    const double theta = 0.5 * pi * (1.0 + std::copysign(std::pow(std::abs(t), 1.0 / squeeze), t));
    for (std::uint32_t j = 0; j < sectors; ++j) at(theta, 2.0 * pi * j / sectors);
  }
  at(pi, 0.0);
  const auto last = static_cast<std::uint32_t>(soup.vertices.size() - 1);
  const auto index = [&](std::uint32_t i, std::uint32_t j) { return 1 + (i - 1) * sectors + j % sectors; };
  for (std::uint32_t j = 0; j < sectors; ++j) {
    soup.triangles.push_back({0, index(1, j), index(1, j + 1)});
    soup.triangles.push_back({last, index(rings - 1, j + 1), index(rings - 1, j)});
    for (std::uint32_t i = 1; i + 1 < rings; ++i) {
      soup.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      soup.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
  return soup;
}

inline models::TriangleSoup globe(std::uint32_t rings, std::uint32_t sectors, double radius) {
  return globe(rings, sectors, [radius](double, double) { return radius; });
}

// An icosahedron whose faces are split into four, `times` times: 20 · 4^times faces.
inline models::TriangleSoup ball(int times, double radius) {
  models::TriangleSoup soup;
  const double g = std::numbers::phi;
  for (const double s : {-1.0, 1.0}) {
    for (const double t : {-g, g}) {
      soup.vertices.emplace_back(0, s, t);
      soup.vertices.emplace_back(s, t, 0);
      soup.vertices.emplace_back(t, 0, s);
    }
  }
  // Faces of the icosahedron: triples of vertices two apart, turned outwards.
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        const models::Vec3 &x = soup.vertices[a], &y = soup.vertices[b], &z = soup.vertices[c];
        if ((x - y).norm() > 2.1 || (y - z).norm() > 2.1 || (z - x).norm() > 2.1) continue;
        if ((y - x).cross(z - x).dot(x) > 0.0) {
          soup.triangles.push_back({a, b, c});
        } else {
          soup.triangles.push_back({a, c, b});
        }
      }
    }
  }
  for (auto& v : soup.vertices) v *= radius / v.norm();
  for (int k = 0; k < times; ++k) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(soup.vertices.size()));
      if (fresh) {
        const models::Vec3 m = soup.vertices[a] + soup.vertices[b];
        soup.vertices.push_back(m * (radius / m.norm()));
      }
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    finer.reserve(4 * soup.triangles.size());
    for (const auto& [a, b, c] : soup.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.push_back({a, ab, ca});
      finer.push_back({ab, b, bc});
      finer.push_back({ca, bc, c});
      finer.push_back({ab, bc, ca});
    }
    soup.triangles = std::move(finer);
  }
  return soup;
}

// A box about the origin, twelve triangles, fronts outside.
inline models::TriangleSoup block(const models::Vec3& size) {
  models::TriangleSoup soup;
  for (int k = 0; k < 8; ++k) {
    soup.vertices.push_back(0.5 * models::Vec3((k & 1) != 0 ? size.x() : -size.x(), (k & 2) != 0 ? size.y() : -size.y(),
                                               (k & 4) != 0 ? size.z() : -size.z()));
  }
  soup.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return soup;
}

// A surface z(x, y) over [−size, size]², n × n squares, fronts up; open borders.
template <typename Height>
models::TriangleSoup field(std::uint32_t n, double size, Height height) {
  models::TriangleSoup soup;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      const double x = size * (2.0 * i / n - 1.0), y = size * (2.0 * j / n - 1.0);
      soup.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      soup.triangles.push_back({a, b, b + 1});
      soup.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return soup;
}

// Binary STL as its description has it: 80 bytes, a count, and 50 bytes a triangle, little-endian.
inline std::string stl_of(const models::TriangleSoup& soup) {
  std::string out(80, ' ');
  out.reserve(84 + 50 * soup.triangles.size());
  const auto put = [&out](const auto& value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    out.append(bytes, sizeof(value));
  };
  put(static_cast<std::uint32_t>(soup.triangles.size()));
  for (const auto& t : soup.triangles) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (const auto v : t) {
      for (const double x : soup.vertices[v]) put(static_cast<float>(x));
    }
    put(std::uint16_t{0});
  }
  return out;
}

// `other` joins `soup`.
inline void join(models::TriangleSoup& soup, const models::TriangleSoup& other) {
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) soup.triangles.push_back({a + first, b + first, c + first});
}

}  // namespace proxarm::tests
