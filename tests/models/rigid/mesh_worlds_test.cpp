#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/rigid/held_tool.hpp"
#include "tests/models/rigid/rigid_judge.hpp"

namespace proxarm::models {
namespace {

const Vec3 block_size(0.1, 0.08, 0.06);

std::shared_ptr<const TriangleMesh> block() {
  TriangleSoup soup;
  soup.vertices = polyhedron_of_box(block_size, Pose::Identity()).corners;
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    soup.triangles.push_back({a, b, c});
    soup.triangles.push_back({a, c, d});
  };
  quad(0, 2, 3, 1);
  quad(4, 5, 7, 6);
  quad(0, 1, 5, 4);
  quad(2, 6, 7, 3);
  quad(0, 4, 6, 2);
  quad(1, 3, 7, 5);
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

double to_block(const Vec3& x) {
  const Vec3 d = x.cwiseAbs() - 0.5 * block_size;
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff());
}

// The distance of a convex function's least value along a segment, by thirds.
double to_block(const Vec3& a, const Vec3& b) {
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 150; ++k) {
    const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
    if (to_block(a + x * (b - a)) < to_block(a + y * (b - a))) {
      high = y;
    } else {
      low = x;
    }
  }
  return std::min({to_block(a + low * (b - a)), to_block(a), to_block(b)});
}

// A tool about or in a block that is a mesh.
Pushed about_block(const Tool& tool, bool inside, const std::function<double(const ToolPose&)>& apart) {
  Pushed out;
  for (std::uint64_t world = 0; world < 15; ++world) {
    Random random(500 + world);
    RigidObject object;
    object.shape = std::make_shared<const TriangleFeatures>(block());
    object.friction = 0.4;
    std::vector<RigidObject> objects;
    objects.push_back(std::move(object));
    RigidWorld g(tool, std::move(objects));
    Mat6 K = Mat6::Zero();
    K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(4e3);
    ToolPose q;
    q.position = (inside ? 0.005 : 0.12) * random.direction();
    q.orientation = rotation_by(random.arrow(0.0, 3.0));
    if (apart(q) < 1e-3) continue;
    push_about(g, random, q, K, {0.4}, 500, Vec3::Zero(), inside, apart, out);
  }
  return out;
}

TEST(RigidWorldsOfMeshes, ACapsuleKeepsTheLaw) {
  expect_law(about_block({{{CapsuleTool{0.03, 0.004}, Pose::Identity(), {}}}}, false, [](const ToolPose& q) {
    return to_block(q * Vec3(0.0, 0.0, -0.015), q * Vec3(0.0, 0.0, 0.015)) - 0.004;
  }));
}

TEST(RigidWorldsOfMeshes, ASphereKeepsTheLaw) {
  expect_law(about_block({{{SphereTool{0.01}, Pose::Identity(), {}}}}, false,
                         [](const ToolPose& q) { return to_block(q.position) - 0.01; }));
}

TEST(RigidWorldsOfMeshes, ATouchedSideIsForgottenWhereTheToolBeginsAnew) {
  // A session starts outside, the next one inside of the block, with the same world: each is held on its side.
  RigidObject object;
  object.shape = std::make_shared<const TriangleFeatures>(block());
  RigidWorld g({{{SphereTool{0.01}, Pose::Identity(), {}}}}, {object});
  const Mat6 K = 1e6 * Mat6::Identity();
  const double top = 0.5 * block_size.z();
  for (const bool inside : {false, true, false}) {
    ToolPose q;
    q.position.z() = inside ? 0.0 : top + 0.02;
    for (int k = 0; k < 50; ++k) {
      ToolPose p = q;
      p.position.z() += inside ? 1e-3 : -1e-3;
      q = g.step(K, p, q);
    }
    EXPECT_NEAR(q.position.z(), inside ? top - 0.01 : top + 0.01, 1e-12) << (inside ? "inside" : "outside");
  }
}

// A step of 0.2 mm among triangles of a millimetre found more features than there is room for, and was unresolved;
// the steps after it were so small that nothing was gathered anew, and the tool stood still for good.
TEST(RigidWorldsOfMeshes, AfterAStepAmongTooManyFeaturesAToolGoesOn) {
  RigidObject object;
  object.shape = std::make_shared<const TriangleFeatures>(std::make_shared<const TriangleMesh>(tests::ball(5, 0.04)));
  object.friction = 0.3;
  ConvexTool pebble;
  for (int i = 0; i < 200; ++i) {  // a spiral on a ball of 1 cm
    const double z = 1.0 - (2.0 * i + 1.0) / 200.0, r = std::sqrt(1.0 - z * z),
                 angle = 2.0 * std::numbers::pi * i / std::numbers::phi;
    pebble.points_m.emplace_back(0.01 * r * std::cos(angle), 0.01 * r * std::sin(angle), 0.01 * z);
  }
  RigidWorld g({{{pebble, Pose::Identity(), {}}}}, {object});
  ToolPose q;
  q.position.x() = 0.052;
  HeldTool held = realistic(q);
  RoamingHand hand{.next_place = [](Random& random, const ToolPose& now) {
    const Vec3 out = (now.position.normalized() + random.in_box(0.2)).normalized();
    return Vec3((0.04 + random.uniform(-0.03, 0.02)) * out);
  }};
  Random random(4);
  int unresolved = 0;
  for (int k = 0; k < 1100; ++k) {
    const ToolPose p = held.freely(hand.wrench(random, held, k));
    held.arrive(g.step(held.K, p, held.q));
    unresolved += g.unresolved() ? 1 : 0;
  }
  EXPECT_LT(unresolved, 10);
}

}  // namespace
}  // namespace proxarm::models
