// Place and rotation judged at once: on gears that couple nothing it is what each is alone, and on the default cell's
// it refuses what swings there. The story: 2 kg and 0.01 kg m² were both stable, and the arm swung at 15 Hz with them,
// in free motion and, more, with its tool laid on a table (tests/command_line/turning_test.py has the session).
#include "controller/stability/pose_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "models/arm/tool_inertia.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using Eigen::MatrixXd;
using models::Mat6;
using models::Vec3;

// Three joints that move the tool along x, y, z, and three that turn it about them, each on its gear.
constexpr double link_kg = 80.0, wrist_kg_m2 = 3.0, mode_rad_per_s = 95.0;
ElasticArm gantry(Eigen::Index first, Eigen::Index count) {
  ElasticArm arm;
  const MatrixXd one = MatrixXd::Identity(count, count);
  Eigen::VectorXd mass(6);
  mass << link_kg, link_kg, link_kg, wrist_kg_m2, wrist_kg_m2, wrist_kg_m2;
  mass = mass.segment(first, count).eval();
  arm.mass = mass.asDiagonal();
  arm.jacobian = arm.joints_per_m = one;
  arm.stiffness = mode_rad_per_s * mode_rad_per_s * mass;
  arm.damping = 2.0 * 0.03 * mode_rad_per_s * mass;
  arm.filter_s = 6e-3;
  return arm;
}

constexpr HandModel place{500.0, 20.0, 1.0}, turning{20.0, 0.5, 0.003};
LoopModel loop_with(double behind) {
  return {.period_s = 1e-3, .delay_s = 16e-3, .drive_time_constant_s = 2e-3, .handle_mass_kg = behind};
}
constexpr double handle_kg = 0.25, handle_kg_m2 = 5e-4;
PoseLoopModel gantry_model() {
  Mat6 behind = Mat6::Zero();
  behind.diagonal() << handle_kg, handle_kg, handle_kg, handle_kg_m2, handle_kg_m2, handle_kg_m2;
  PoseLoopModel model;
  model.place = place;
  model.turning = turning;
  model.behind_sensor_W = behind;
  model.loop = loop_with(handle_kg);
  return model;
}

// With either kind of drive.
double smallest_alone(Eigen::Index first, const HandModel& hand, double behind) {
  LoopModel loop = loop_with(behind);
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(1, gantry(first, 3));
  const double lagging = *smallest_stable_mass(hand, loop);
  loop.feed_forward = true;
  return std::max(lagging, *smallest_stable_mass(hand, loop)) + behind;
}

TEST(PoseLoop, IsEachAloneWhereNothingCouplesThem) {
  const PoseLoop both(gantry(0, 6), gantry_model());
  const double least_kg = smallest_alone(0, place, handle_kg), least_kg_m2 = smallest_alone(3, turning, handle_kg_m2);
  EXPECT_NEAR(*both.smallest_inertia(2.0 * least_kg), least_kg_m2, 0.01 * least_kg_m2);
  EXPECT_TRUE(both.stable(1.01 * least_kg, 1.01 * least_kg_m2));
  EXPECT_FALSE(both.stable(1.01 * least_kg, 0.98 * least_kg_m2));
  EXPECT_FALSE(both.stable(0.98 * least_kg, 1.01 * least_kg_m2));
  EXPECT_FALSE(both.smallest_inertia(0.98 * least_kg)) << "no inertia helps a mass that is too small";
}

// What is held may be as light as it likes.
TEST(PoseLoop, AContactTakesItsDirectionsFromTheLoop) {
  const PoseLoopModel model = gantry_model();
  const ElasticLoop both(
      gantry(0, 6),
      {Mat6(500.0 * Mat6::Identity()), Mat6(20.0 * Mat6::Identity()), Mat6(Mat6::Identity()), Mat6(Mat6::Zero())},
      model.loop);
  const MatrixXd none = Mat6::Zero();
  const auto radius = [&](double place_kg, double other_kg, const MatrixXd& N) {
    Mat6 M = Mat6::Identity();
    M.diagonal() << place_kg, place_kg, place_kg, other_kg, other_kg, other_kg;
    return both.spectral_radius({M, none, none}, N);
  };
  const MatrixXd free(6, 0), held = Mat6::Identity().leftCols(3);
  EXPECT_GT(radius(0.05, 4.0, free), 1.0);
  EXPECT_LT(radius(0.05, 4.0, held), 1.0);
  EXPECT_NEAR(radius(0.05, 4.0, held), radius(40.0, 4.0, held), 1e-9);
}

TEST(PoseLoop, HeldInTTheToolTurnsAlone) {
  PoseLoopModel model = gantry_model();
  const double mass_kg = 2.0 * smallest_alone(0, place, handle_kg);
  const double free = *PoseLoop(gantry(0, 6), model).smallest_inertia(mass_kg);
  model.touched = {{Vec3::Zero(), Vec3::UnitZ()}};
  EXPECT_NEAR(*PoseLoop(gantry(0, 6), model).smallest_inertia(mass_kg), free, 0.01 * free);
}

PoseLoopModel default_model(const description::Cell& cell, const models::Arm& arm) {
  PoseLoopModel model = gantry_model();
  model.behind_sensor_W = behind_sensor_W(cell, arm.tool_pose(arm.start_rad()).linear());
  model.loop = loop_with(cell.tool.mass_kg);
  model.loop.delay_s = 15.6e-3;  // as `proxarm run` tells it, less the period
  return model;
}

TEST(PoseLoop, RefusesWhatSwingsOnTheDefaultCellThoughEachAloneIsStable) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  PoseLoopModel model = default_model(cell, arm);
  const ElasticArm start = elastic_pose_arm(arm, arm.start_rad(), cell);
  LoopModel alone = model.loop;
  alone.arms = std::make_shared<const std::vector<ElasticArm>>(1, elastic_arm(arm, arm.start_rad(), cell));
  EXPECT_LT(spectral_radius(place, alone, 2.0 - cell.tool.mass_kg), 1.0);
  alone.handle_mass_kg = models::tool_inertia(cell.tool).largest_kg_m2;
  alone.arms = std::make_shared<const std::vector<ElasticArm>>(
      1, elastic_turning_arm(arm, arm.start_rad(), cell, place.mass_kg));
  EXPECT_LT(spectral_radius(turning, alone, 0.01 - alone.handle_mass_kg), 1.0);

  const PoseLoop free(start, model);
  EXPECT_FALSE(free.stable(2.0, 0.01));
  EXPECT_TRUE(free.stable(4.0, 0.05));
  const double smallest = *free.smallest_inertia(2.0);
  EXPECT_TRUE(free.stable(2.0, 1.001 * smallest));
  EXPECT_FALSE(free.stable(2.0, 0.99 * smallest));

  // 4 kg bear less where the tool is held beside T: 30 mm below it and 60 mm out, sliding or stuck.
  model.touched = {{Vec3(0.06, 0.0, -0.03), Vec3::UnitZ()}};
  EXPECT_GT(*PoseLoop(start, model).smallest_inertia(4.0), 1.05 * *free.smallest_inertia(4.0));
}

// The story: 0.0031 kg m² were the smallest for this hand, by drives that lag and so take from a mode at 70 Hz. Without
// friction the simulated arm, whose drives feed forward, swings by itself up to 0.0031, at 82 Hz, and not with 0.0033.
TEST(PoseLoop, DrivesThatFeedForwardAskForMoreOfAHandThatTurnsStiffly) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  PoseLoopModel model = default_model(cell, arm);
  model.turning = {60.0, 0.5, 0.02};
  model.turning_damping_Nms_per_rad = 0.5;
  model.loop.delay_s = 14.04e-3;
  model.loop.drive_time_constant_s = 1.59e-3;
  const double smallest = *pose_loop_at(arm, arm.start_rad(), cell, model).smallest_inertia(4.0);
  EXPECT_GT(smallest, 0.0033);
  EXPECT_LT(smallest, 0.0033 * elastic_margin * 1.02);
  // Drives without a lag are of one kind only, and follow better than both.
  model.loop.drive_time_constant_s = 0.0;
  EXPECT_LT(*pose_loop_at(arm, arm.start_rad(), cell, model).smallest_inertia(4.0), 0.0031);
}

TEST(PoseLoop, TellsTheSwingThatTakesLongest) {
  const PoseLoop both(gantry(0, 6), gantry_model());
  const double least_kg = smallest_alone(0, place, handle_kg);
  const auto near = both.slowest_swing(1.1 * least_kg, 0.2), far = both.slowest_swing(3.0 * least_kg, 0.2);
  ASSERT_TRUE(near && far);
  EXPECT_GT(near->tenth_s, far->tenth_s);
  EXPECT_GE(near->frequency_Hz, 3.0);
}

// A hand of 20 Nm/rad swings 0.05 kg m² at 3.2 Hz for longer than the arm does at 17 Hz with less damping. One that
// damps that to 0.7 of the critical damping lets it creep back, and the arm's is told.
TEST(PoseLoop, TellsASlowSwingButNoCreep) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  PoseLoopModel model = default_model(cell, arm);
  const auto swing = pose_loop_at(arm, arm.start_rad(), cell, model).slowest_swing(4.0, 0.05);
  ASSERT_TRUE(swing);
  EXPECT_NEAR(swing->frequency_Hz, 3.2, 0.2);
  EXPECT_GT(swing->tenth_s, 0.9);
  model.turning_damping_Nms_per_rad = 1.4;
  const auto damped = pose_loop_at(arm, arm.start_rad(), cell, model).slowest_swing(4.0, 0.05);
  ASSERT_TRUE(damped);
  EXPECT_GT(damped->frequency_Hz, 10.0);
  EXPECT_LT(damped->tenth_s, 0.9);
}

}  // namespace
}  // namespace proxarm::controller
