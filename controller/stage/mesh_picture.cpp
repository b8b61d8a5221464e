#include "controller/stage/mesh_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <vector>

namespace proxarm::view {
namespace {

using models::Vec3;
using Corners = std::array<std::uint32_t, 3>;

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<Corners> triangles;
};

template <typename Number>
void put(std::string& bytes, Number number) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof number);
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

double area(std::span<const Vec3> vertices, std::span<const Corners> triangles) {
  double twice = 0.0;
  for (const Corners& t : triangles) {
    twice += (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm();
  }
  return 0.5 * twice;
}

// Returns a triangle's corners rotated so that the smallest index comes first. The triangle's orientation is kept.
Corners begun_at_smallest(const Corners& t) {
  const auto first = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
  return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
}

// Makes a mesh coarser by vertex clustering (Rossignac, Borrel 1993): all vertices within a cube of a grid are replaced
// by their mean, and triangles with two corners in one cube are left out.
Mesh clustered(std::span<const Vec3> vertices, std::span<const Corners> triangles, double cube) {
  constexpr int bits = 21;  // bits of a cube's number along an axis; three such numbers fit into a key
  Vec3 low = vertices.front(), high = low;
  for (const Vec3& v : vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
  cube = std::max(cube, (high - low).maxCoeff() / ((1 << bits) - 1));
  Mesh out;
  std::vector<std::uint32_t> cluster_of(vertices.size());
  std::vector<double> members;
  std::unordered_map<std::uint64_t, std::uint32_t> clusters;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      key = key << bits | static_cast<std::uint64_t>((vertices[i][axis] - low[axis]) / cube);
    }
    const auto [found, is_new] = clusters.try_emplace(key, static_cast<std::uint32_t>(out.vertices.size()));
    if (is_new) out.vertices.emplace_back(Vec3::Zero()), members.push_back(0.0);
    cluster_of[i] = found->second;
    out.vertices[found->second] += vertices[i];
    members[found->second] += 1.0;
  }
  for (std::size_t i = 0; i < out.vertices.size(); ++i) out.vertices[i] /= members[i];
  for (const Corners& t : triangles) {
    const Corners c{cluster_of[t[0]], cluster_of[t[1]], cluster_of[t[2]]};
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) out.triangles.push_back(begun_at_smallest(c));
  }
  std::sort(out.triangles.begin(), out.triangles.end());
  out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
  return out;
}

std::string packed(std::span<const Vec3> vertices, std::span<const Corners> triangles, const Vec3& scale) {
  std::string bytes;
  bytes.reserve(8 + 12 * vertices.size() + 12 * triangles.size());
  put(bytes, static_cast<std::uint32_t>(vertices.size()));
  put(bytes, static_cast<std::uint32_t>(triangles.size()));
  for (const Vec3& v : vertices) {
    for (int i = 0; i < 3; ++i) put(bytes, static_cast<float>(v[i] * scale[i]));
  }
  for (const Corners& t : triangles) {
    for (const std::uint32_t corner : t) put(bytes, corner);
  }
  return bytes;
}

}  // namespace

std::string mesh_picture(std::span<const Vec3> vertices, std::span<const Corners> triangles, const Vec3& scale) {
  if (triangles.size() <= most_triangles) return packed(vertices, triangles, scale);
  // First guess: a cube on a smooth surface keeps about three triangles. On a rough surface it keeps more.
  double cube = std::sqrt(3.0 * area(vertices, triangles) / static_cast<double>(most_triangles));
  Mesh coarse = clustered(vertices, triangles, cube);
  for (constexpr double larger = 1.2; coarse.triangles.size() > most_triangles;) {
    cube *= larger;
    coarse = clustered(vertices, triangles, cube);
  }
  return packed(coarse.vertices, coarse.triangles, scale);
}

}  // namespace proxarm::view
