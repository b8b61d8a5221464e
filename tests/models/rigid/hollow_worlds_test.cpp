// Tools inside of hollow spheres, capsules, cylinders and boxes at random: after each step nothing sticks out, and the
// law holds. A peg in its hole, whose clearance is a thousandth of its radius, among them.
#include <gtest/gtest.h>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid_judges/rigid_hollows.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"

namespace proxarm::models {
namespace {

// In all directions, by up to 2 mm and 0.02 rad a step, or as a hand moves a peg: 0.3 mm and 0.01 rad.
Pushed inside_of(const Hollow& hollow, const Shaped& tool, std::uint64_t seed, int steps, double mu,
                 const Vec2& most = {2e-3, 2e-2}) {
  Pushed out;
  Random random(seed);
  std::vector<RigidObject> objects;
  for (const auto& shape : hollow.shapes) {
    RigidObject object;
    object.shape = shape;
    object.friction = mu;
    objects.push_back(std::move(object));
  }
  RigidWorld g(tool.tool, std::move(objects));
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(5e4);
  const auto apart = [&](const ToolPose& pose) { return least_depth(tool.inside, pose, hollow.depth); };
  ToolPose q;
  EXPECT_GT(apart(q), 0.0);
  EXPECT_NEAR(g.clearance_m(q), apart(q), 1e-15);
  Twist way = Twist::Zero();
  for (int k = 0; k < steps; ++k) {
    if (k % 25 == 0) way << random.log_arrow(1e-7, most[0]), random.log_arrow(1e-6, most[1]);
    const ToolPose p = moved(q, way), r = g.step(K, p, q);
    out.take(g, apart(r), [&] {
      LawFigures law = judge_law(g.contacts(), K, p, q, r, {mu});
      law.imbalance = imbalance(g.contacts(), K, p, r);
      return law;
    });
    q = r;
  }
  return out;
}

void take(Pushed& all, const Pushed& one) {
  all.judged += one.judged;
  all.touching += one.touching;
  all.unresolved += one.unresolved;
  all.deepest = std::min(all.deepest, one.deepest);
  all.law.take(one.law);
}

// What is unresolved are wedges: two contacts that hold each other by friction, while the tool turns about the line
// between them.
void expect_law_inside(const Pushed& out) {
  EXPECT_GE(out.deepest, -1e-12);
  EXPECT_GT(out.touching, 300) << "or else this looks at nothing";
  EXPECT_LE(out.unresolved, out.judged / 100);
  EXPECT_LE(out.law.imbalance, 1e-9) << "where contacts hold each other, a local problem is solved to 1e-10 of a step";
  EXPECT_LE(out.law.outside_cone, 1e-12);
  EXPECT_LE(out.law.against_slip, 1e-4) << "of a slip of a picometre, by places of 1e-16 m";
  EXPECT_EQ(out.law.pull, 0.0);
  EXPECT_LE(out.law.gap_m, 1e-10) << "of a contact that presses with 1e-9 of the largest force";
}

class HollowWorlds : public ::testing::TestWithParam<int> {};

TEST_P(HollowWorlds, KeepTheLaw) {
  const std::array<Hollow, 4> hollows = {hollow_sphere(0.04), hollow_capsule(0.05, 0.03), hollow_cylinder(0.07, 0.03),
                                         hollow_box({0.05, 0.06, 0.07})};
  for (std::size_t i = 0; i < hollows.size(); ++i) {
    if (GetParam() == 3 && i == 1) continue;  // refused by compile_rigid()
    SCOPED_TRACE(i);
    Pushed all;
    for (std::uint64_t world = 0; world < 10; ++world) {
      Random random(900 + world);
      take(all, inside_of(hollows[i], random_tool_inside(random, GetParam()), 700 + world, 300, 0.3));
    }
    expect_law_inside(all);
  }
}

INSTANTIATE_TEST_SUITE_P(Tools, HollowWorlds, ::testing::Range(0, 4));

TEST(HollowWorlds, APegOfFifteenMicrometresKeepsTheLaw) {
  for (const double length : {0.01, 0.03}) {
    SCOPED_TRACE(length);
    const Pushed all =
        inside_of(hollow_cylinder(0.2, 0.01), cylinder_tool(length, 0.01 - 15e-6), 31, 4000, 0.15, {3e-4, 1e-2});
    expect_law_inside(all);
  }
}

}  // namespace
}  // namespace proxarm::models
