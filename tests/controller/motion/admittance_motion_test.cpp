#include "controller/motion/admittance_motion.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/allocation_count.hpp"
#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;
using testing::Watched;

// The default arm in free space. It follows its setpoints exactly and at once, unless a test says otherwise.
struct AdmittanceMotionTest : ::testing::Test {
  AdmittanceMotionTest() {
    measured.motor_rad = measured.drive_target_rad = arm.motor_from_link(arm.start_rad());
    measured.moved_rad = measured.answers.period_s = JointVector::Zero(6);
    measured.fresh = measured.following = 0b111111;
    follow();
    motion->wait_for_drives(measured);
  }
  [[nodiscard]] std::unique_ptr<AdmittanceMotion> made() {
    AdmittanceParts parts{
        .inverse = models::InverseKinematics(arm, {.max_step_rad = max_steps_rad(cell.drives, settings.period_s)}),
        .elastic = ElasticSetpoint(arm, cell.limits.setpoint_bandwidth_Hz, settings.period_s),
        .tool =
            std::make_unique<PointTool>(make_rendered_world(scene, settings, settings.mass_kg), OrientationConfig{}),
        .links = std::nullopt,
        .release = std::make_unique<Release>(settings, OrientationConfig{}, cell.supervision.release_speed_m_per_s)};
    return std::make_unique<AdmittanceMotion>(std::move(parts), arm, cell.drives, cell.limits, cell.supervision,
                                              settings);
  }
  // The arm is where the setpoints are.
  void follow() {
    measured.moved_rad = motion->setpoints().values - measured.motor_rad;
    measured.motor_rad = motion->setpoints().values;
    measured.link_rad = arm.link_from_motor(measured.motor_rad);
    measured.tool_W = arm.tool_pose(measured.link_rad).translation();
  }
  [[nodiscard]] MotionCycle cycle() {
    record = {};
    motion->begin_cycle();
    return {.measured = measured, .slowed = slowed, .alarm = watched.alarm, .record = record};
  }
  void render(int cycles) {
    for (int k = 0; k < cycles; ++k) {
      ASSERT_TRUE(motion->render(cycle()));
      if (follows) follow();
    }
  }
  [[nodiscard]] Vec3 commanded_W() const {
    return arm.tool_pose(arm.link_from_motor(motion->setpoints().values)).translation();
  }

  description::Cell cell = testing::default_cell();
  models::Arm arm{cell};
  SessionSettings settings;
  scenes::CompiledScene scene = scenes::compile(scenes::Scene{});
  std::unique_ptr<AdmittanceMotion> motion = made();
  Measured measured;
  Watched watched;
  CycleRecord record;
  bool slowed = false, follows = true;
};

TEST_F(AdmittanceMotionTest, BeginsWithTheLastSetpointAndStaysThereWithoutAForce) {
  const JointVector before = motion->setpoints().values;
  motion->start(measured, Beginning::first);
  EXPECT_EQ(motion->setpoints().values, before);
  render(100);
  EXPECT_LT((motion->setpoints().values - before).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(motion->made_setpoints());
}

TEST_F(AdmittanceMotionTest, MovesWithTheForceAndBelowTheSpeedLimit) {
  motion->start(measured, Beginning::first);
  const Vec3 before_W = motion->proxy_W();
  measured.hand_W.force = Vec3(0.0, 0.0, 10.0);
  Vec3 last_W = before_W;
  for (int k = 0; k < 500; ++k) {
    render(1);
    const double speed = (motion->proxy_W() - last_W).norm() / settings.period_s;
    ASSERT_LE(speed, cell.limits.max_tool_speed_m_per_s * (1.0 + 1e-9));
    last_W = motion->proxy_W();
  }
  EXPECT_GT(motion->proxy_W().z(), before_W.z() + 0.02);
  EXPECT_LT((commanded_W() - motion->proxy_W()).norm(), 0.05) << "the setpoints follow the proxy behind the filter";
}

TEST_F(AdmittanceMotionTest, LetsTheForceInByAndBy) {
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(0.0, 0.0, 10.0);
  render(1);
  EXPECT_TRUE(record.has(RecordFlag::ramp_in));
  render(static_cast<int>(std::ceil(cell.supervision.ramp_in_s / settings.period_s)) + 1);
  EXPECT_FALSE(record.has(RecordFlag::ramp_in));
}

TEST_F(AdmittanceMotionTest, ComesToRestInEveryJoint) {
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(0.0, 10.0, 0.0);
  render(400);
  motion->start_run_out();
  EXPECT_FALSE(motion->stands());
  JointVector last = motion->setpoints().values, last_step = JointVector::Zero(6);
  int cycles = 0;
  for (; cycles < 2'000 && !motion->stands(); ++cycles) {
    motion->begin_cycle();
    motion->run_out();
    const JointVector step = motion->setpoints().values - last;
    for (int i = 0; i < 6 && cycles > 0; ++i) {
      const double most = cell.drives[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2 * 1e-6;
      ASSERT_LE(std::abs(step[i] - last_step[i]), most * (1.0 + 1e-6)) << "joint " << i;
    }
    last = motion->setpoints().values;
    last_step = step;
  }
  EXPECT_LT(cycles, 2'000);
  motion->run_out();
  EXPECT_EQ(motion->setpoints().values, last);
}

TEST_F(AdmittanceMotionTest, WaitsForADriveThatDoesNotFollow) {
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(0.0, 0.0, 10.0);
  follows = false;
  bool waited = false;
  for (int k = 0; k < 3'000 && !waited; ++k) {
    motion->render(cycle());
    waited = motion->active().has(Limit::following_error);
  }
  ASSERT_TRUE(waited);
  for (int k = 0; k < 500; ++k) motion->render(cycle());
  const JointVector ahead = motion->setpoints().values - measured.motor_rad;
  EXPECT_LT(ahead.cwiseAbs().maxCoeff(), 5.0 * cell.limits.following_error_rad) << "nothing winds up";
}

// An encoder that said 5 mrad too much led the arm by 1.05 m, at 0.6 m/s: the setpoint was put beside the report, the
// arm went there, and so did the report.
TEST_F(AdmittanceMotionTest, IsLedNowhereByAnEncoderThatLies) {
  for (const double off_rad : {1.5e-3, -5e-3, 5e-3, 0.02}) {
    for (const int joint : {0, 1, 2, 4}) {
      SCOPED_TRACE(std::to_string(1e3 * off_rad) + " mrad, joint " + std::to_string(joint));
      motion = made();
      motion->wait_for_drives(measured);
      motion->start(measured, Beginning::first);
      const JointVector before = motion->setpoints().values;
      for (int k = 0; k < 1'000; ++k) {
        motion->render(cycle());
        follow();
        measured.motor_rad[joint] += off_rad;
      }
      // Gravity's twist of the gears is computed anew from cycle to cycle, to rounding.
      EXPECT_LT((motion->setpoints().values - before).cwiseAbs().maxCoeff(), 1e-9);
      measured.motor_rad = before;
      follow();
    }
  }
}

// It may creep, too, by turns: what the setpoint follows is the hand alone.
TEST_F(AdmittanceMotionTest, IsLedNowhereByAReportThatCreepsAndSwings) {
  motion->start(measured, Beginning::first);
  const JointVector before = motion->setpoints().values;
  for (int k = 0; k < 2'000; ++k) {
    motion->render(cycle());
    follow();
    measured.motor_rad[1] += 5e-6 * k + 3e-3 * std::sin(0.05 * k);
    measured.moved_rad[1] = 5e-6 + 1.5e-4 * std::cos(0.05 * k);
  }
  EXPECT_LT((motion->setpoints().values - before).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(AdmittanceMotionTest, StopsWhereTheToolIsTooFarBehind) {
  motion->start(measured, Beginning::first);
  measured.tool_W += Vec3(0.0, 0.0, 2.0 * cell.limits.leash_m);
  EXPECT_TRUE(motion->render(cycle())) << "the step was made";
  EXPECT_EQ(watched.times(Fault::leash_exceeded), 1u);
}

TEST_F(AdmittanceMotionTest, ReleasesSlowlyAndBacksOffByAsMuchAsItWasTold) {
  EXPECT_FALSE(motion->prepare_freeing({Order::back_off, 0.05}, measured)) << "nothing says which way";
  measured.hand_W.force = Vec3(20.0, 0.0, 0.0);
  ASSERT_TRUE(motion->prepare_freeing({Order::back_off, 0.05}, measured)) << "to where the hand pushes";
  EXPECT_TRUE(motion->backs_off());
  motion->start(measured, Beginning::freeing);
  const Vec3 before_W = motion->proxy_W();
  int cycles = 0;
  while (cycles < 10'000 && !motion->free(cycle())) {
    follow();
    ++cycles;
  }
  EXPECT_LT(cycles, 10'000);
  EXPECT_NEAR((motion->proxy_W() - before_W).x(), 0.05, 1e-4);

  EXPECT_TRUE(motion->prepare_freeing({Order::release, 0.0}, measured));
  EXPECT_FALSE(motion->backs_off());
}

TEST_F(AdmittanceMotionTest, ResumesSlowlyOutOfAHold) {
  motion->start(measured, Beginning::resuming);
  render(1);
  EXPECT_TRUE(record.has(RecordFlag::slowed));
  motion->start(measured, Beginning::first);
  slowed = true;
  render(1'000);
  EXPECT_TRUE(record.has(RecordFlag::slowed));
}

// What a replay needs: the same steps from a state that was written and read back.
TEST_F(AdmittanceMotionTest, GoesOnToTheBitFromWhatWasArchived) {
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(3.0, -2.0, 10.0);
  render(300);
  std::vector<std::byte> bytes(8192);
  fieldbus::StateArchive writer = fieldbus::StateArchive::writer(bytes);
  motion->archive(writer);
  ASSERT_TRUE(writer.whole());
  const Measured then = measured;
  render(200);
  const JointVector expected = motion->setpoints().values;
  const Vec3 expected_W = motion->proxy_W();

  motion = made();
  measured = then;
  fieldbus::StateArchive reader = fieldbus::StateArchive::reader(std::span(bytes).first(writer.bytes()));
  motion->archive(reader);
  EXPECT_TRUE(reader.whole());
  EXPECT_EQ(reader.bytes(), writer.bytes());
  render(200);
  EXPECT_EQ(motion->setpoints().values, expected);
  EXPECT_EQ(motion->proxy_W(), expected_W);
}

TEST_F(AdmittanceMotionTest, StaysWhereItIsWhenThePeriodChanges) {
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(0.0, 0.0, 10.0);
  render(300);
  motion->start_run_out();
  for (int k = 0; k < 2'000; ++k) motion->run_out();
  ASSERT_TRUE(motion->stands());
  const JointVector before = motion->setpoints().values;
  motion->set_period(2e-3);
  EXPECT_EQ(motion->setpoints().values, before);
  follow();
  measured.hand_W = {};
  motion->start(measured, Beginning::resuming);
  render(50);
  EXPECT_LT((motion->setpoints().values - before).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(AdmittanceMotionTest, TakesNothingFromTheHeap) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  motion->start(measured, Beginning::first);
  measured.hand_W.force = Vec3(0.0, 0.0, 10.0);
  const std::uint64_t before = tests::allocation_count();
  for (int k = 0; k < 200; ++k) motion->render(cycle());
  motion->start_run_out();
  for (int k = 0; k < 200; ++k) motion->run_out();
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace proxarm::controller
