// The mass is judged where the arm comes by, not only where it starts.
#include "controller/stability/passed_poses.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "models/arm/inverse_kinematics.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;

// The default cell at 2 ms, where it starts and with the tool elsewhere.
class PassedPosesTest : public ::testing::Test {
 protected:
  PassedPosesTest() {
    loop_.period_s = 2e-3;
    loop_.delay_s = 0.020;
    loop_.handle_mass_kg = cell_.tool.mass_kg;
  }

  JointVector joints_at(const Vec3& offset_W) const {
    const models::InverseKinematics inverse(arm_);
    models::InverseKinematicsResult solution;
    JointVector q = arm_.start_rad();
    for (int step = 1; step <= 100; ++step) {
      models::Pose X_WT = arm_.tool_pose(arm_.start_rad());
      X_WT.translation() += step / 100.0 * offset_W;
      inverse.solve(q, X_WT, solution);
      EXPECT_EQ(solution.status, models::InverseKinematicsResult::Status::converged);
      q = solution.q;
    }
    return q;
  }

  // The felt mass at which the loop there is just stable, by halving: a way to it that shares nothing with the sweep of
  // smallest_stable_mass().
  double least_kg_at(const JointVector& joints_rad) const {
    LoopModel loop = loop_;
    loop.arms = std::make_shared<const std::vector<ElasticArm>>(1, elastic_arm(arm_, joints_rad, cell_));
    double low = 0.1, high = 100.0;
    while (high > 1.0001 * low) {
      const double middle = std::sqrt(low * high);
      (spectral_radius(hand_, loop, middle) < 1.0 ? high : low) = middle;
    }
    return high + loop_.handle_mass_kg;
  }

  // Two cycles, since in the first the mass may have just changed.
  bool pass(PassedPoses& poses, double time_s, const Vec3& offset_W, double felt_kg) const {
    const auto joints = [&] { return joints_at(offset_W); };
    const models::ToolPose tool_W{.position = arm_.tool_pose(arm_.start_rad()).translation() + offset_W};
    bool told = false;
    for (int cycle = 0; cycle < 2; ++cycle) {
      const auto asked = poses.come_to(time_s, tool_W, {.mass_kg = felt_kg}, joints);
      told = (asked && poses.judge(*asked)) || told;
    }
    return told;
  }

  const description::Cell cell_ = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm_{cell_};
  const HandModel hand_;
  LoopModel loop_;
};

TEST_F(PassedPosesTest, HowFarFromSwingingItIsIsFoundWhereItIsAskedFor) {
  const Vec3 away(0.25, 0.0, 0.0);
  const double felt_kg = 2.0 * least_kg_at(joints_at(away));
  PassedPoses silent(arm_, cell_, hand_, loop_), asked(arm_, cell_, hand_, loop_);
  asked.find_smallest();
  for (PassedPoses* poses : {&silent, &asked}) {
    EXPECT_FALSE(pass(*poses, 1.0, Vec3::Zero(), felt_kg));
    EXPECT_FALSE(pass(*poses, 2.0, away, felt_kg));
  }
  EXPECT_TRUE(silent.places().empty());
  ASSERT_EQ(asked.places().size(), 2U);
  EXPECT_EQ(asked.places()[1].time_s, 2.0);
  EXPECT_EQ(asked.places()[1].felt_mass_kg, felt_kg);
  EXPECT_NEAR(asked.places()[0].smallest_stable_mass_kg.value_or(0.0), least_kg_at(joints_at(Vec3::Zero())), 0.02);
  EXPECT_NEAR(asked.places()[1].smallest_stable_mass_kg.value_or(0.0), 0.5 * felt_kg, 0.02);
}

TEST_F(PassedPosesTest, AMassThatIsStableAtTheStartIsToldWhereItIsNot) {
  const Vec3 away(0.25, 0.0, 0.0);
  const double at_start_kg = least_kg_at(arm_.start_rad()), away_kg = least_kg_at(joints_at(away));
  ASSERT_GT(away_kg, 1.1 * at_start_kg);
  PassedPoses poses(arm_, cell_, hand_, loop_);
  const double felt_kg = std::sqrt(at_start_kg * away_kg);
  EXPECT_FALSE(pass(poses, 1.0, Vec3::Zero(), felt_kg));
  EXPECT_FALSE(poses.unstable());
  EXPECT_TRUE(pass(poses, 2.0, away, felt_kg));
  ASSERT_TRUE(poses.unstable());
  EXPECT_TRUE(poses.unstable()->lacks_mass);
  EXPECT_EQ(poses.unstable()->first_s, 2.0);
  EXPECT_EQ(poses.unstable()->felt_mass_kg, felt_kg);
  // The sweep's own resolution: tests/controller/stability/elastic_loop_test.cpp holds it to a per mille.
  EXPECT_NEAR(*poses.unstable()->smallest_stable, away_kg, 2e-3 * away_kg);
  EXPECT_FALSE(pass(poses, 3.0, Vec3(0.0, 0.25, 0.0), felt_kg)) << "it is told once";
}

TEST_F(PassedPosesTest, AMassThatIsStableInBothIsNot) {
  const Vec3 away(0.25, 0.0, 0.0);
  const double felt_kg = 1.001 * std::max(least_kg_at(arm_.start_rad()), least_kg_at(joints_at(away)));
  PassedPoses poses(arm_, cell_, hand_, loop_);
  EXPECT_FALSE(pass(poses, 1.0, Vec3::Zero(), felt_kg));
  EXPECT_FALSE(pass(poses, 2.0, away, felt_kg));
  EXPECT_EQ(poses.judged(), 2u);
}

TEST_F(PassedPosesTest, APlaceIsJudgedOnceForEachMassAndNotWhileTheMassChanges) {
  PassedPoses poses(arm_, cell_, hand_, loop_);
  for (int round = 0; round < 3; ++round) {
    pass(poses, 1.0, Vec3::Zero(), 10.0);
    pass(poses, 1.0, Vec3(0.049, 0.0, 0.0), 10.0);
    pass(poses, 1.0, Vec3(0.051, 0.0, 0.0), 10.0);
  }
  EXPECT_EQ(poses.judged(), 2u);
  pass(poses, 2.0, Vec3::Zero(), 12.0);
  EXPECT_EQ(poses.judged(), 3u);
  const auto joints = [&] { return arm_.start_rad(); };
  for (int cycle = 0; cycle < 100; ++cycle) {
    const models::ToolPose tool_W{.position = arm_.tool_pose(arm_.start_rad()).translation()};
    EXPECT_FALSE(poses.come_to(3.0, tool_W, {.mass_kg = 12.0 + 0.01 * cycle}, joints));
  }
  EXPECT_EQ(poses.judged(), 3u);
}

TEST_F(PassedPosesTest, AnotherTimestepIsJudgedAnew) {
  const double felt_kg = 1.1 * least_kg_at(arm_.start_rad());
  PassedPoses poses(arm_, cell_, hand_, loop_);
  EXPECT_FALSE(pass(poses, 1.0, Vec3::Zero(), felt_kg));
  LoopModel slow = loop_;
  slow.period_s = 8e-3;
  slow.delay_s = 0.026;
  poses.change(slow);
  EXPECT_TRUE(pass(poses, 2.0, Vec3::Zero(), felt_kg));
}

// A tool that is led and turned at once, at 1 ms.
class TurnedPosesTest : public ::testing::Test {
 protected:
  TurnedPosesTest() {
    loop_.period_s = 1e-3;
    loop_.delay_s = 15e-3;
    loop_.handle_mass_kg = cell_.tool.mass_kg;
    turned_.place = hand_;
    turned_.turning = {20.0, 0.5, 0.003};
    turned_.loop = loop_;
    turned_.touched = {{Vec3(0.0, 0.0, 0.1), Vec3(0.0, 0.0, 1.0)}};
  }

  JointVector joints_at(const Vec3& offset_W, const Vec3& turn_W) const {
    return led_poses(arm_, {{offset_W, turn_W}}).back();
  }
  double least_kg_m2_at(const JointVector& joints_rad) const {
    const PoseLoop loop = pose_loop_at(arm_, joints_rad, cell_, turned_);
    double low = 1e-3, high = 10.0;
    while (high > 1.0001 * low) {
      const double middle = std::sqrt(low * high);
      (loop.stable(mass_kg, middle) ? high : low) = middle;
    }
    return high;
  }
  std::optional<UnstablePlaces> pass(PassedPoses& poses, double time_s, const Vec3& offset_W, const Vec3& turn_W,
                                     double inertia_kg_m2) const {
    const auto joints = [&] { return joints_at(offset_W, turn_W); };
    const models::Pose start = arm_.tool_pose(arm_.start_rad());
    const models::ToolPose tool_W{start.translation() + offset_W,
                                  models::rotation_by(turn_W) * models::Quaternion(start.linear())};
    const PassedPoses::Felt felt{.mass_kg = mass_kg, .inertia_kg_m2 = inertia_kg_m2};
    std::optional<UnstablePlaces> told;
    for (int cycle = 0; cycle < 2 && !told; ++cycle) {
      if (const auto asked = poses.come_to(time_s, tool_W, felt, joints)) told = poses.judge(*asked);
    }
    return told;
  }

  static constexpr double mass_kg = 4.0;
  const description::Cell cell_ = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm_{cell_};
  const HandModel hand_;
  LoopModel loop_;
  PoseLoopModel turned_;
};

TEST_F(TurnedPosesTest, AnInertiaThatIsStableAtTheStartIsToldWhereTheToolIsTurned) {
  const Vec3 away(0.2, 0.0, 0.0), turned(0.0, 0.4, 0.0), none = Vec3::Zero();
  const double at_start = least_kg_m2_at(arm_.start_rad()), there = least_kg_m2_at(joints_at(away, turned));
  ASSERT_GT(there, 1.5 * at_start);
  PassedPoses poses(arm_, cell_, hand_, loop_, turned_);
  const double inertia = std::sqrt(at_start * there);
  EXPECT_FALSE(pass(poses, 1.0, none, none, inertia));
  const std::optional<UnstablePlaces> told = pass(poses, 2.0, away, turned, inertia);
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->lacks_mass);
  EXPECT_EQ(told->felt_inertia_kg_m2, inertia);
  EXPECT_NEAR(*told->smallest_stable, there, 6e-3 * there);  // smallest_inertia's own resolution
  EXPECT_FALSE(pass(poses, 3.0, away, turned, 1.01 * there)) << "what it takes is stable there";
}

TEST_F(TurnedPosesTest, WhatAsksForHalfAsMuchAgainIsToldAnew) {
  const Vec3 none = Vec3::Zero();
  PassedPoses poses(arm_, cell_, hand_, loop_, turned_);
  const double at_start = least_kg_m2_at(arm_.start_rad()), inertia = 0.9 * at_start;
  ASSERT_TRUE(pass(poses, 1.0, none, none, inertia));
  std::optional<UnstablePlaces> last;
  double told = at_start;
  for (int i = 1; i <= 8; ++i) {
    const Vec3 away(0.025 * i, 0.0, 0.0), turned(0.0, 0.05 * i, 0.0);
    const double there = least_kg_m2_at(joints_at(away, turned));
    const std::optional<UnstablePlaces> now = pass(poses, 1.0 + i, away, turned, inertia);
    if (!now) continue;
    EXPECT_NEAR(*now->smallest_stable, there, 6e-3 * there);
    EXPECT_GT(there, 1.49 * told);
    EXPECT_EQ(now->first_s, 1.0);
    EXPECT_EQ(now->worst_s, 1.0 + i);
    told = there;
    last = now;
  }
  EXPECT_TRUE(last);
  EXPECT_TRUE(pass(poses, 20.0, none, none, 0.8 * at_start)) << "another inertia is told of anew";
}

TEST_F(TurnedPosesTest, ATurnedToolIsJudgedAnewBeyondATenthOfARadian) {
  const Vec3 none = Vec3::Zero();
  PassedPoses poses(arm_, cell_, hand_, loop_, turned_);
  pass(poses, 1.0, none, none, 0.1);
  pass(poses, 1.0, none, Vec3(0.0, 0.099, 0.0), 0.1);
  EXPECT_EQ(poses.judged(), 1u);
  pass(poses, 1.0, none, Vec3(0.0, 0.101, 0.0), 0.1);
  EXPECT_EQ(poses.judged(), 2u);
}

}  // namespace
}  // namespace proxarm::controller
