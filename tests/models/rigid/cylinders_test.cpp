// The outside of cylinders, as tools and as objects: nothing overlaps, and the law holds.
#include <gtest/gtest.h>

#include <functional>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid/cylinder_bodies.hpp"

namespace proxarm::models {
namespace {

Mat6 random_stiffness(Random& random) {
  const double M = random.log_uniform(0.5, 20.0), J = M * random.log_uniform(1e-4, 1e-2);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(1e6 * M), Vec3::Constant(1e6 * J);
  return K;
}

Can random_can(Random& random, double least, double most) {
  Can can;
  can.length = random.uniform(least, most);
  can.radius = 0.5 * random.uniform(least, most);
  return can;
}

double random_friction(Random& random) { return random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.8); }

void push(RigidWorld& g, Random& random, const std::vector<double>& mu,
          const std::function<double(const ToolPose&)>& apart_m, Pushed& out) {
  ToolPose q;
  do {
    q = tool_pose(random_pose(random, 0.15));
  } while (apart_m(q) < 1e-3);
  push_about(g, random, q, random_stiffness(random), mu, 200, Vec3::Zero(), false, apart_m, out);
}

// A cylinder as a tool among solids.
Pushed a_can_among(std::uint64_t seed, int kind) {
  Pushed out;
  for (std::uint64_t world = 0; world < 40; ++world) {
    Random random(seed + world);
    const Can tool = random_can(random, 0.01, 0.05);
    std::vector<RigidObject> objects;
    std::vector<Rounded> bodies;
    std::vector<double> mu;
    for (int i = 0; i < 6; ++i) {
      Body body;
      do {
        body = random_body(random, 0.02, 0.1);
      } while (kind == 0 ? body.radius > 0.0 : !(body.radius > 0.0));
      body.X = random_pose(random, 0.08);
      mu.push_back(random_friction(random));
      bodies.push_back(rounded(body));
      objects.push_back(object_of(body, mu.back(), i));
    }
    RigidWorld g({{{CylinderTool{tool.length, tool.radius}, Pose::Identity(), {}}}}, std::move(objects));
    push(
        g, random, mu,
        [&](const ToolPose& pose) {
          double gap = 1.0;
          for (const Rounded& body : bodies) gap = std::min(gap, apart(at(tool, isometry(pose)), body));
          return gap;
        },
        out);
  }
  return out;
}

TEST(Cylinders, AsAToolAmongBoxesOneKeepsTheLaw) { expect_law(a_can_among(1000, 0)); }
TEST(Cylinders, AsAToolAmongSpheresAndCapsulesOneKeepsTheLaw) { expect_law(a_can_among(2000, 1)); }

// Tools among cylinders.
Pushed among_cans(std::uint64_t seed, int kind) {
  Pushed out;
  for (std::uint64_t world = 0; world < 40; ++world) {
    Random random(seed + world);
    Body tool;
    do {
      tool = random_body(random, 0.01, 0.05);
    } while (kind == 0 ? tool.radius > 0.0 : !(tool.radius > 0.0));
    std::vector<RigidObject> objects;
    std::vector<Can> cans;
    std::vector<double> mu;
    for (int i = 0; i < 6; ++i) {
      Can can = random_can(random, 0.02, 0.1);
      can.X = random_pose(random, 0.08);
      mu.push_back(random_friction(random));
      cans.push_back(can);
      objects.push_back({solid_of_can(can), mu.back(), i});
    }
    RigidWorld g({{{shape_of(tool), Pose::Identity(), {}}}}, std::move(objects));
    push(
        g, random, mu,
        [&](const ToolPose& pose) {
          double gap = 1.0;
          const Rounded body = rounded(at(tool, isometry(pose)));
          for (const Can& can : cans) gap = std::min(gap, apart(can, body));
          return gap;
        },
        out);
  }
  return out;
}

TEST(Cylinders, AsObjectsTheyHoldABoxByTheLaw) { expect_law(among_cans(3000, 0)); }
TEST(Cylinders, AsObjectsTheyHoldSpheresAndCapsulesByTheLaw) { expect_law(among_cans(4000, 1)); }

}  // namespace
}  // namespace proxarm::models
