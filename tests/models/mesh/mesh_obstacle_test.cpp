// A mesh that is concave, beside another object: what holds is several faces of the one together with the other.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/world/world.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

// Two leaning walls with their edge through the origin, and a floor: the walls as a mesh, or as planes.
struct Corner {
  Vec3 u, v, up, n_u, n_v, floor, middle;

  explicit Corner(Random& random) {
    const double angle = random.uniform(0.3, 2.6), lean = random.uniform(-0.5, 0.5);
    u = Vec3::UnitX();
    v = Vec3(std::cos(angle), std::sin(angle), 0.0);
    up = Vec3(lean, 0.3 * lean, 1.0);
    floor = Vec3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 1.0).normalized();
    middle = (u + v).normalized();
    n_u = inwards(u.cross(up));
    n_v = inwards(v.cross(up));
  }

  [[nodiscard]] std::unique_ptr<World> of_mesh(double mu) const {
    TriangleSoup soup;
    for (const Vec3& along : {Vec3(Vec3::Zero()), Vec3(2.0 * u), Vec3(2.0 * v)}) {
      soup.vertices.emplace_back(along - up);
      soup.vertices.emplace_back(along + up);
    }
    soup.triangles = {{0, 2, 3}, {0, 3, 1}, {0, 5, 4}, {0, 1, 5}};
    std::vector<World::Entry> entries;
    entries.push_back({std::make_unique<MeshObstacle>(std::make_shared<const TriangleMesh>(soup), mu), 0, -1});
    return on_floor(std::move(entries), mu);
  }
  [[nodiscard]] std::unique_ptr<World> of_planes(double mu) const {
    std::vector<World::Entry> entries;
    entries.push_back({std::make_unique<PlaneObstacle>(Vec3::Zero(), n_u, mu), 0, 0});
    entries.push_back({std::make_unique<PlaneObstacle>(Vec3::Zero(), n_v, mu), 0, 1});
    return on_floor(std::move(entries), mu);
  }
  [[nodiscard]] double depth(const Vec3& q) const { return -std::min({n_u.dot(q), n_v.dot(q), floor.dot(q)}); }

 private:
  [[nodiscard]] Vec3 inwards(const Vec3& n) const { return (n.dot(middle) < 0.0 ? -n : n).normalized(); }
  [[nodiscard]] std::unique_ptr<World> on_floor(std::vector<World::Entry> entries, double mu) const {
    entries.push_back({std::make_unique<PlaneObstacle>(Vec3::Zero(), floor, mu), 1, 0});
    return std::make_unique<World>(std::move(entries));
  }
};

// Pushed about and into the corner: never through a wall, and where three planes hold it. They lie a lift (3e-14 m)
// lower, which friction in a sharp corner multiplies; and where Coulomb's law has several solutions each may take
// another one.
TEST(MeshObstacle, HoldsAProxyInItsCornerOnAFloor) {
  Random random(801);
  std::int64_t steps = 0, unresolved = 0, elsewhere = 0;
  for (std::int64_t run = 0; run < scaled(2000); ++run) {
    const Corner corner(random);
    const double mu = random.chance(0.5) ? 0.0 : random.uniform(0.0, 1.0);
    const auto mesh = corner.of_mesh(mu), planes = corner.of_planes(mu);
    Vec3 q = 0.2 * corner.middle + 0.3 * corner.up;
    if (corner.depth(q) > -1e-3) continue;
    for (int k = 0; k < 100 && q.norm() < 1.0; ++k) {
      const Vec3 towards = random.direction<3>() - 0.7 * corner.middle - 0.7 * Vec3::UnitZ();
      const Vec3 p = q + random.log_uniform(1e-6, 0.3) * towards;
      const Vec3 by_planes = (*planes)(1000.0, p, q);
      const std::uint64_t before = mesh->unresolved_steps();
      q = (*mesh)(1000.0, p, q);
      ASSERT_LE(corner.depth(q), 1e-12) << "run " << run << ", step " << k;
      ++steps;
      if (mesh->unresolved_steps() != before) {
        ++unresolved;
      } else if ((q - by_planes).norm() > 1e-9) {
        ++elsewhere;
        EXPECT_GT(mu, 0.0) << "run " << run << ", step " << k;
      }
    }
  }
  std::printf("  %lld steps, %lld unresolved, %lld elsewhere than three planes\n", static_cast<long long>(steps),
              static_cast<long long>(unresolved), static_cast<long long>(elsewhere));
  EXPECT_LE(unresolved, steps / 100);
  EXPECT_LE(elsewhere, steps / 1000);
}

}  // namespace
}  // namespace proxarm::tests
