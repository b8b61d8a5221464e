#include "controller/studies/stress/tool_laws.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::studies {
namespace {

using models::PoseContact;
using models::Vec3;

// Held by a normal at 45° after a way of 1 mm along x, by 10 N.
struct OverAnEdge {
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.01)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  OverAnEdge() {
    scenes::Object box;
    box.shape = scenes::BoxShape{};
    scene.objects.push_back(box);
    call.K = 1e6 * models::Mat6::Identity();
    call.r.position.x() = 1e-3;
    call.contacts.push_back(contact(Vec3(1.0, 0.0, 1.0)));
  }
  [[nodiscard]] PoseContact contact(const Vec3& normal) const {
    PoseContact out;
    out.normal_W = normal.normalized();
    out.force_W = 10.0 * out.normal_W;
    out.point_W = call.r.position;
    out.friction = 0.5;
    return out;
  }
  [[nodiscard]] double allowed_J(const Vec3& earlier) const {
    return ToolLaws(scene, tool).edges_J(call, {contact(earlier)}, {});
  }
};

TEST(ToolLaws, ANormalThatTurnsOverAnEdgeMayDoItsSineOfTheWay) {
  const double work_J = 10.0 * 1e-3 * std::sqrt(0.5);  // of the force along the way
  EXPECT_NEAR(OverAnEdge().allowed_J(Vec3(0.0, 0.0, 1.0)), work_J, 1e-12 * work_J);
}

// A normal along which the place has come forward doesn't turn into one that pushes: its own push was there before.
TEST(ToolLaws, WhatAPlaceCameFromBehindSaysNothingAboutAnEdge) {
  EXPECT_EQ(OverAnEdge().allowed_J(Vec3(0.1, 0.0, 1.0)), 0.0);
  EXPECT_EQ(OverAnEdge().allowed_J(Vec3(1.0, 0.0, 1.0)), 0.0);
}

TEST(ToolLaws, WhereNothingWasMetNoEdgeIsTurnedOver) {
  const OverAnEdge here;
  EXPECT_EQ(ToolLaws(here.scene, here.tool).edges_J(here.call, {}, {}), 0.0);
}

// With 1e5 N/m a force of 10 N goes 0.1 mm, and over an edge of 45° the place by tan 45° of that. Another contact, with
// a normal at 53° to the edge's plane, lets the tool go askew only: by 1 − 0.6² as far along the plane for the same
// force. The way goes so askew; all of the sine of it is then allowed, or nothing.
struct OverAnEdgeHeld : OverAnEdge {
  PoseContact holds = contact(Vec3(0.6, 0.8, 0.0));

  explicit OverAnEdgeHeld(double way_m) {
    call.K = 1e5 * models::Mat6::Identity();
    call.r.position = way_m * Vec3(0.8, -0.6, 0.0);
    call.contacts.front().point_W = call.r.position;
    holds.feature = 7;
    holds.point_W = call.r.position;
    call.contacts.push_back(holds);
  }
  [[nodiscard]] bool is_over(const std::vector<PoseContact>& before) const {
    PoseContact plane = contact(Vec3::UnitZ());
    return ToolLaws(scene, tool).edges_J(call, {plane}, before) > 0.0;
  }
};
constexpr double free_m = 1e-4, held_m = (1.0 - 0.6 * 0.6) * free_m, little = 1e-9;

TEST(ToolLaws, AWayOverAnEdgeIsAsLongAsWhatHeldTheToolBeforeLetsItBe) {
  for (const double most : {free_m, held_m}) {
    const OverAnEdgeHeld less((1.0 - little) * most), more((1.0 + little) * most);
    EXPECT_EQ(less.is_over({less.holds}), most == free_m);
    EXPECT_TRUE(more.is_over({more.holds}));
    EXPECT_FALSE(less.is_over({}));
    EXPECT_EQ(more.is_over({}), most == free_m);
  }
}

TEST(ToolLaws, WhatIsNewOrDidNotPressOrLeftItsPlaneHoldsNothingOverAnEdge) {
  const OverAnEdgeHeld here(0.5 * (free_m + held_m));
  ASSERT_TRUE(here.is_over({here.holds}));
  PoseContact was = here.holds;
  was.feature = 8;
  EXPECT_FALSE(here.is_over({was}));
  was = here.holds;
  was.force_W.setZero();
  EXPECT_FALSE(here.is_over({was}));
  was = here.holds;
  was.normal_W = Vec3(0.6, 0.8, 1e-6).normalized();  // the tool hasn't turned
  EXPECT_FALSE(here.is_over({was}));
  OverAnEdgeHeld left = here;
  left.call.contacts.back().normal_W = left.holds.normal_W = Vec3(0.6, 0.8, 0.01).normalized();
  EXPECT_TRUE(left.is_over({left.holds}));
  left.call.r.position.z() -= 1e-9;  // by 1e-11 m along that normal, where 1e-12 m are rounding
  EXPECT_FALSE(left.is_over({left.holds}));
}

// A force that leans against the way by μ lets the tool go on by 1 − 0.6 (0.6 − 0.8 μ) of what it would.
TEST(ToolLaws, WhatHoldsByFrictionDoesSoWithTheForceItHadAndTheOneItHas) {
  const double mu = 0.25, rubbed_m = (1.0 - 0.6 * (0.6 - 0.8 * mu)) * free_m;
  const Vec3 leaning = 10.0 * Vec3(0.6 - 0.8 * mu, 0.8 + 0.6 * mu, 0.0);
  for (const double share : {1.0 - little, 1.0 + little}) {
    OverAnEdgeHeld here(share * rubbed_m);
    PoseContact rubs = here.holds;
    rubs.force_W = leaning;
    EXPECT_TRUE(here.is_over({here.holds}));
    EXPECT_EQ(here.is_over({rubs}), share > 1.0);
    here.call.contacts.back() = rubs;
    EXPECT_EQ(here.is_over({here.holds}), share > 1.0);
  }
}

// A contact a metre aside that sticks leaves the tool to turn about it: of 1e5 N/m and 1e5 Nm/rad the place then
// yields by 1/(1e5 + 1e5), half of what it does freely (and less by 2.5e-9, the square of how far it turns). Where it
// slips, it holds along its normal only.
TEST(ToolLaws, WhatSticksHoldsAlongAllDirectionsOverAnEdge) {
  for (const double share : {1.0 - 10.0 * little, 1.0 + 10.0 * little}) {
    OverAnEdgeHeld here(0.5 * share * free_m);
    const Vec3 pivot = Vec3::UnitY();
    here.call.r.orientation = models::rotation_by(2.0 * std::asin(0.25 * share * free_m) * Vec3::UnitZ());
    here.call.r.position = pivot - here.call.r.orientation * pivot;
    here.call.contacts[0].point_W = here.call.r.position;
    here.call.contacts[1].point_W = here.holds.point_W = pivot;
    EXPECT_EQ(here.is_over({here.holds}), share > 1.0);
    here.call.q.position.x() -= 1e-14;  // 16 roundings
    EXPECT_FALSE(here.is_over({here.holds}));
  }
}

// A tool that rolls there, about a pivot 1/32 m aside, comes off by its curvature and sticks as much: θ² lever/2. What
// nothing rubs on holds along its normal only, though it happens to stand still.
TEST(ToolLaws, WhatRollsSticksAndWhatHasNoFrictionDoesNot) {
  const double lever_m = 1.0 / 32.0, way_m = 0.55 * free_m, turn = 2.0 * std::asin(0.5 * way_m / lever_m);
  OverAnEdgeHeld here(way_m);
  const Vec3 pivot = lever_m * Vec3::UnitY(), n = here.holds.normal_W;
  here.call.K.bottomRightCorner<3, 3>() *= lever_m * lever_m;
  here.call.r.orientation = models::rotation_by(turn * Vec3::UnitZ());
  here.call.r.position = pivot - here.call.r.orientation * pivot;
  here.call.contacts[0].point_W = here.call.r.position;
  here.call.contacts[1].point_W = here.holds.point_W = pivot;
  const double off_m = 0.5 * turn * turn * lever_m;
  for (const double share : {0.99, 1.01}) {
    OverAnEdgeHeld rolls = here;
    rolls.call.q.position -= share * off_m * n;
    EXPECT_EQ(rolls.is_over({here.holds}), share < 1.0);
  }
  here.call.contacts[1].friction = 0.0;
  EXPECT_FALSE(here.is_over({here.holds}));
}

// Two edges that cross at 0.05 rad, along x = 0 that of the object, and a tool that turns by 0.005 rad about x: the
// normal turns by 0.1 rad.
struct CrossingEdges {
  static constexpr double between = 0.05, turn = 0.005, way_m = 1e-4;
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.01)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  // `aside`: by how much more the tool came from behind the plane that the edges had at q; m.
  explicit CrossingEdges(double aside_m, double crossing = between) {
    scenes::Object box;
    scenes::BoxShape shape;
    shape.pose_W = models::Pose::Identity();
    shape.pose_W.linear() = Eigen::AngleAxisd(0.8, Vec3::UnitY()).toRotationMatrix();
    shape.size_m = Vec3::Constant(0.1);
    shape.pose_W.translation() = -(shape.pose_W.linear() * Vec3(-0.05, 0.0, 0.05));
    box.shape = shape;
    scene.objects.push_back(box);
    // The tool's lower left edge along y lies on the origin, turned about z and then about x.
    const auto turned = [&](double about_x) {
      return models::Quaternion(models::rotation_by(Vec3(about_x, 0.0, 0.0)) *
                                models::rotation_by(Vec3(0.0, 0.0, -crossing)) *
                                models::rotation_by(Vec3(0.0, -0.8, 0.0)));
    };
    const Vec3 corner(-0.005, 0.0, -0.005);
    call.K = 1e6 * models::Mat6::Identity();
    call.r.orientation = turned(0.0);
    call.r.position = -(call.r.orientation * corner);
    call.q.orientation = turned(-turn);
    const Vec3 own = call.q.orientation * Vec3::UnitY();
    const Vec3 n0 = own.cross(Vec3::UnitY()).normalized(), n = Vec3::UnitZ();
    const Vec3 up = n0.z() > 0.0 ? n0 : Vec3(-n0);
    const Vec3 along = (n - n.dot(up) * up).normalized();
    call.q.position = -(call.q.orientation * corner) - way_m * along - aside_m * up;
    PoseContact contact;
    contact.object = contact.part = 0;
    contact.normal_W = n;
    contact.force_W = 10.0 * n;
    call.contacts.push_back(contact);
  }
  [[nodiscard]] double allowed_J() const { return ToolLaws(scene, tool).curvature_J(call); }
};

TEST(ToolLaws, ANormalOfCrossingEdgesTurnsByMoreThanTheTool) {
  const double sine = std::sin(std::atan2(std::sin(CrossingEdges::turn), std::tan(CrossingEdges::between)));
  const double lever_m = 0.005 * std::sqrt(2.0), theta = CrossingEdges::turn, force_N = 10.0;
  const double bends_m = 0.5 * theta * theta * lever_m;
  const double by_edges_J = force_N * (bends_m + sine * CrossingEdges::way_m);
  EXPECT_NEAR(CrossingEdges(0.0).allowed_J(), by_edges_J, 1e-9 * by_edges_J);
  // The edges came from behind each other: by what rounding and gaps may be short of, or by more.
  EXPECT_NEAR(CrossingEdges(1.99e-12).allowed_J(), by_edges_J, 1e-6 * by_edges_J);
  const double by_turn_J = force_N * (bends_m + theta * CrossingEdges::way_m);
  EXPECT_NEAR(CrossingEdges(2.01e-12).allowed_J(), by_turn_J, 1e-6 * by_turn_J);
}

// Nor where the contact is on no edge, or its normal is another one.
TEST(ToolLaws, WhereNoEdgesCrossANormalTurnsByWhatTheToolDoes) {
  CrossingEdges off(0.0), leaning(0.0);
  const double by_turn_J = 10.0 * CrossingEdges::way_m * CrossingEdges::turn;  // and a fifth for its lever
  off.call.contacts[0].point_W = Vec3(0.0, 0.0, 3e-12);
  EXPECT_LT(off.allowed_J(), 1.3 * by_turn_J);
  leaning.call.contacts[0].normal_W = Vec3(0.0, 1e-6, 1.0).normalized();
  EXPECT_LT(leaning.allowed_J(), 1.3 * by_turn_J);
}

}  // namespace
}  // namespace proxarm::studies
