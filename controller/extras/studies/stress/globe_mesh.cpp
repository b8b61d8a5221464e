#include "controller/extras/studies/stress/globe_mesh.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace proxarm::studies {

using models::Vec3;
using std::numbers::pi;

scenes::MeshShape globe_mesh(std::uint32_t rings, std::uint32_t sectors,
                             const std::function<Vec3(const Vec3&)>& place) {
  models::TriangleSoup soup;
  const auto add = [&](double theta, double phi) {
    const Vec3 x(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    soup.vertices.push_back(place(x));
  };
  add(0.0, 0.0);
  for (std::uint32_t i = 1; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sectors; ++j) add(pi * i / rings, 2.0 * pi * j / sectors);
  }
  add(pi, 0.0);
  const auto at = [&](std::uint32_t ring, std::uint32_t sector) { return 1 + (ring - 1) * sectors + sector % sectors; };
  const auto last = static_cast<std::uint32_t>(soup.vertices.size() - 1);
  for (std::uint32_t j = 0; j < sectors; ++j) {
    soup.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (std::uint32_t i = 1; i + 1 < rings; ++i) {
      soup.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      soup.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    soup.triangles.push_back({last, at(rings - 1, j + 1), at(rings - 1, j)});
  }
  scenes::MeshShape shape;
  shape.mesh = std::make_shared<const models::TriangleMesh>(std::move(soup));
  return shape;
}

}  // namespace proxarm::studies
