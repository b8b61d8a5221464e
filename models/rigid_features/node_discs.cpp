#include "models/rigid_features/node_discs.hpp"

#include <limits>

namespace proxarm::models {
namespace {

// A node with more triangles than this gets the ball around its box instead of a thin disc. Searches visit few such
// nodes, and so many triangles are rarely flat.
constexpr std::uint32_t kMostFaces = 512;

// Returns `size` as a float that is never smaller. Coordinates of the size `of_coordinates` and their sums are rounded
// by some 1e-16 of that size.
float at_least(double size, double of_coordinates) noexcept {
  const double rounding = 16.0 * std::numeric_limits<double>::epsilon() * of_coordinates;
  return std::nextafter(static_cast<float>(size + rounding), std::numeric_limits<float>::infinity());
}

NodeDisc ball_around(const TriangleMesh::NodePair& pair, std::size_t k) noexcept {
  const Vec3 low(pair.low(k, 0), pair.low(k, 1), pair.low(k, 2));
  const Vec3 high(pair.high(k, 0), pair.high(k, 1), pair.high(k, 2));
  NodeDisc disc;
  disc.middle = 0.5 * (low + high);
  disc.half = disc.radius = disc.ball = at_least(0.5 * (high - low).norm(), disc.middle.lpNorm<1>());
  return disc;
}

// Returns the disc around the triangles from `begin` to `end`. Its axis is the mean normal of the triangles. If the
// mean is zero, any axis is correct.
NodeDisc disc_of(const TriangleMesh& mesh, std::uint32_t begin, std::uint32_t end) noexcept {
  Vec3 sum = Vec3::Zero(), low = mesh.corner(begin, 0), high = low;
  for (std::uint32_t f = begin; f < end; ++f) {
    const Vec3 &a = mesh.corner(f, 0), &b = mesh.corner(f, 1), &c = mesh.corner(f, 2);
    sum += (b - a).cross(c - a);
    low = low.cwiseMin(a).cwiseMin(b).cwiseMin(c);
    high = high.cwiseMax(a).cwiseMax(b).cwiseMax(c);
  }
  const double size = sum.norm();
  NodeDisc disc;
  if (size > 0.0) disc.axis = sum / size;
  const Vec3 middle = 0.5 * (low + high);
  double least = std::numeric_limits<double>::infinity(), most = -least, radius2 = 0.0;
  const auto each_corner = [&](auto visit) {
    for (std::uint32_t f = begin; f < end; ++f) {
      for (const std::size_t k : {0U, 1U, 2U}) visit(mesh.corner(f, k));
    }
  };
  each_corner([&](const Vec3& corner) {
    const Vec3 way = corner - middle;
    const double along = disc.axis.dot(way);
    least = std::min(least, along);
    most = std::max(most, along);
    radius2 = std::max(radius2, (way - along * disc.axis).squaredNorm());
  });
  disc.middle = middle + 0.5 * (least + most) * disc.axis;
  double ball2 = 0.0;
  each_corner([&](const Vec3& corner) { ball2 = std::max(ball2, (corner - disc.middle).squaredNorm()); });
  const double far = low.cwiseAbs().cwiseMax(high.cwiseAbs()).sum();
  disc.half = at_least(0.5 * (most - least), far);
  disc.radius = at_least(std::sqrt(radius2), far);
  disc.ball = at_least(std::sqrt(ball2), far);
  return disc;
}

}  // namespace

// The triangles of a node have consecutive indices: first the triangles of its first child, then those of its second
// child.
NodeDiscs::NodeDiscs(const TriangleMesh& mesh) {
  const auto& nodes = mesh.structure().nodes;
  struct Range {
    std::uint32_t begin = 0, end = 0;
  };
  std::vector<Range> ranges(2 * nodes.size());
  discs_.resize(2 * nodes.size());
  // Parents come before their children, so the loop runs backwards. The root is the only node in its pair, so index 1
  // is skipped.
  for (std::size_t i = discs_.size(); i-- > 0;) {
    const std::size_t pair = i / 2, k = i % 2, within = 2 * std::size_t{nodes[pair].first[k]};
    if (i == 1) continue;
    const std::uint32_t first = nodes[pair].first[k], count = nodes[pair].count[k];
    ranges[i] = count > 0 ? Range{first, first + count} : Range{ranges[within].begin, ranges[within + 1].end};
    const bool few = ranges[i].end - ranges[i].begin <= kMostFaces;
    discs_[i] = few ? disc_of(mesh, ranges[i].begin, ranges[i].end) : ball_around(nodes[pair], k);
  }
}

}  // namespace proxarm::models
