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

}  // namespace
}  // namespace proxarm::studies
