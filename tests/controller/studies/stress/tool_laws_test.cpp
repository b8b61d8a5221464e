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
    return ToolLaws(scene, tool).edges_J(call, {contact(earlier)});
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
  EXPECT_EQ(ToolLaws(here.scene, here.tool).edges_J(here.call, {}), 0.0);
}

}  // namespace
}  // namespace proxarm::studies
