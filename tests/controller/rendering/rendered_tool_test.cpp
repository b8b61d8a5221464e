// What a motion may rely on whether the tool is a point or has a shape.
#include "controller/rendering/rendered_tool.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;
const Vec3 start_W(0.7, 0.0, 0.6);
const Eigen::Quaterniond upright = Eigen::Quaterniond::Identity();

Eigen::Quaterniond turned(double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Vec3::UnitZ())); }

StepLimits no_limits() {
  StepLimits limits;
  limits.q_k1_W = start_W;
  return limits;
}

struct RenderedToolTest : ::testing::Test {
  static OrientationConfig orientation() {
    OrientationConfig config;
    config.free = true;
    config.period_s = T;
    return config;
  }
  std::unique_ptr<RenderedTool> point() {
    return std::make_unique<PointTool>(make_rendered_world(empty, SessionSettings{}, 4.0), orientation());
  }

  scenes::CompiledScene empty = scenes::compile(scenes::Scene{});
};

TEST_F(RenderedToolTest, APointTurnsOnFromWhereItIsToldAndStaysInItsPlace) {
  const std::unique_ptr<RenderedTool> tool = point();
  tool->start(start_W, upright);
  EXPECT_EQ(tool->turn_on(turned(0.2), Vec3(0, 0, 1.0), start_W, Vec3::Zero()), start_W);
  EXPECT_NEAR(tool->R_WT().angularDistance(turned(0.2)), 0.0, 1e-9);
  tool->turn(Vec3::Zero());
  const WorldStep step = tool->step(Vec3::Zero(), no_limits());
  EXPECT_NEAR((step.q_W - start_W).norm(), 0.0, 1e-15);
  // D/J is 10/s: a hundredth is lost in the step.
  EXPECT_NEAR(tool->omega_W().z(), 1.0 / (1.0 + 10.0 * T), 1e-12);
  EXPECT_NEAR(tool->R_WT().angularDistance(turned(0.2)), T / (1.0 + 10.0 * T), 1e-9);
}

TEST_F(RenderedToolTest, ATorqueThatIsntANumberIsAFaultOfTheStep) {
  const std::unique_ptr<RenderedTool> tool = point();
  tool->start(start_W, upright);
  tool->turn(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_NE(tool->step(Vec3::Zero(), no_limits()).fault, ProxyFault::none);
  EXPECT_TRUE(tool->R_WT().coeffs().allFinite());
  tool->turn(Vec3::Zero());
  EXPECT_EQ(tool->step(Vec3::Zero(), no_limits()).fault, ProxyFault::none);
}

TEST_F(RenderedToolTest, AnglesAreCountedFromTheFirstStartOrFromWhereItIsTold) {
  PointTool tool(make_rendered_world(empty, SessionSettings{}, 4.0), orientation());
  tool.start(start_W, turned(0.1));
  tool.start(start_W, turned(0.3));
  EXPECT_NEAR(tool.sets().home.angularDistance(turned(0.1)), 0.0, 1e-12);
  PointTool freed(make_rendered_world(empty, SessionSettings{}, 4.0), orientation());
  freed.count_from(tool.sets().home);
  freed.start(start_W, turned(0.3));
  EXPECT_NEAR(freed.sets().home.angularDistance(turned(0.1)), 0.0, 1e-12);
}

// τ = −(J/τ_b − D) ω brings the turning to rest in braking_s; more damping than that needs no torque.
TEST_F(RenderedToolTest, WhatBrakesItsTurningIsWhatItsDampingLeaves) {
  const std::unique_ptr<RenderedTool> tool = point();
  tool->start(start_W, upright);
  tool->set({Parameter::inertia, 0.2});
  EXPECT_EQ(tool->turn_on(upright, Vec3(0, 0, 0.5), start_W, Vec3::Zero()), start_W);
  const double wanted = 0.2 / TurnSets::braking_s - tool->turning_damping_Nms_per_rad();
  ASSERT_GT(wanted, 0.0);
  EXPECT_NEAR(tool->braking_torque_W().z(), -0.5 * wanted, 1e-12);
  tool->add_turning_damping(2.0 * wanted);
  EXPECT_EQ(tool->braking_torque_W(), Vec3::Zero());
}

}  // namespace
}  // namespace proxarm::controller
