// A tool that stands on more places than a local problem has room for.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid_judges/held_tool.hpp"

namespace proxarm::models {
namespace {

constexpr double mu = 0.4;

ConvexTool prism(int sides) {
  ConvexTool tool;
  for (int k = 0; k < sides; ++k) {
    const double a = 2.0 * std::numbers::pi * k / sides;
    for (const double z : {0.0, 0.08}) tool.points_m.emplace_back(0.03 * std::cos(a), 0.03 * std::sin(a), z);
  }
  return tool;
}

Tool nine_legs() {
  Tool tool;
  for (int i = 0; i < 9; ++i) {
    Pose X = Pose::Identity();
    const int row = i / 3;
    X.translation() = Vec3(0.03 * (i % 3), 0.03 * row, 0.025);
    tool.parts.push_back({BoxTool{Vec3(0.01, 0.01, 0.05)}, X, {}});
  }
  return tool;
}

// Stands on the plane z = 0, pressed by `down` newtons and pulled aside at the height of the plane: it slides as a
// point of its mass does, and turns by nothing.
void expect_slides(const Tool& tool, const Vec3& middle) {
  constexpr double down = 7.5, aside = 29.75;
  constexpr int steps = 200;
  RigidWorld g(tool, {RigidObject{FlatSide{Vec3::UnitZ(), 0.0}, mu}});
  HeldTool held = realistic({Vec3::Zero(), Eigen::Quaterniond::Identity()});
  for (int k = 1; k <= steps; ++k) {
    Twist w = Twist::Zero();
    w.head<3>() = Vec3(aside, 0.0, -down);
    w.tail<3>() = middle.cross(Vec3(mu * down, 0.0, -down));  // the press in the middle of what stands
    const ToolPose r = g.step(held.K, held.freely(w), held.q);
    ASSERT_FALSE(g.unresolved()) << k;
    double f_n = 0.0;
    for (const PoseContact& contact : g.contacts()) f_n += contact.force_W.z();
    ASSERT_NEAR(f_n, down, 1e-9 * down) << k;
    held.arrive(r);
  }
  const double a = (aside - mu * down) / held.M[0];
  EXPECT_NEAR(held.q.position.x(), 0.5 * steps * (steps + 1) * a * HeldTool::T * HeldTool::T, 1e-9);
  EXPECT_NEAR(held.q.position.z(), 0.0, 1e-15);
  EXPECT_LT(rotation_vector(held.q.orientation).norm(), 1e-9);
}

TEST(ManyContacts, APrismOfManySidesSlidesOnATableAsAPointDoes) {
  for (const int sides : {4, 12, 24, 25, 32, 64, 128}) {
    SCOPED_TRACE(sides);
    expect_slides({{{prism(sides), Pose::Identity(), {}}}}, Vec3::Zero());
  }
}

TEST(ManyContacts, ATableOfNineLegsSlidesAsAPointDoes) { expect_slides(nine_legs(), {0.03, 0.03, 0.0}); }

// Dropped askew: it rocks from corner to corner and comes to lie, with no step that finds no forces twice in a row.
TEST(ManyContacts, APrismThatIsSetDownAskewComesToStand) {
  for (const int sides : {24, 32, 64, 128}) {
    RigidWorld g({{{prism(sides), Pose::Identity(), {}}}}, {RigidObject{FlatSide{Vec3::UnitZ(), 0.0}, mu}});
    HeldTool held(4.0, 0.05, 20.0, 0.5);
    held.q = {Vec3(0.0, 0.0, 0.003), rotation_by(Vec3(0.05, 0.03, 0.0))};
    int unresolved = 0, in_a_row = 0, longest = 0;
    for (int k = 0; k < 2000; ++k) {
      Twist w = Twist::Zero();
      w.z() = -15.0;
      held.arrive(g.step(held.K, held.freely(w), held.q));
      unresolved += g.unresolved();
      in_a_row = g.unresolved() ? in_a_row + 1 : 0;
      longest = std::max(longest, in_a_row);
    }
    EXPECT_LE(unresolved, 20) << sides;  // one in a hundred
    EXPECT_LE(longest, 2) << sides;
    EXPECT_LT((held.q.orientation * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-12) << sides;
    EXPECT_NEAR(held.q.position.z(), 0.0, 1e-14) << sides;
  }
}

}  // namespace
}  // namespace proxarm::models
