#include "sim/physics/proof_helper.hpp"

#include <gtest/gtest.h>

#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;
constexpr std::int64_t ms = 1'000'000;

// An arm that nobody but the helper touches, with its drives enabled unless told otherwise.
struct HelpedArm {
  HelpedArm() : plant(default_cell(), default_sensor(), no_hand()), helper(plant) {}

  void enable() {
    for (std::size_t i = 0; i < plant.axis_count(); ++i) plant.servo(i).enable(plant.time_ns());
  }
  // The hand's force at the end.
  Vec3 after(std::int64_t time_ms) {
    for (const std::int64_t end_ns = plant.time_ns() + time_ms * ms; plant.time_ns() < end_ns;) {
      plant.advance_to(plant.time_ns() + ms);
      helper.on_time(plant.time_ns());
    }
    return plant.handle_force_W();
  }
  // Turns an axis by 10 mrad in 0.1 s.
  void turn(std::size_t axis) {
    const std::int32_t from = plant.servo(axis).demand_counts();
    const auto way = static_cast<std::int32_t>(0.01 * default_cell().drives[axis].counts_per_rad());
    for (int k = 1; k <= 100; ++k) {
      plant.servo(axis).set_target(from + way * k / 100, plant.time_ns());
      after(1);
    }
  }

  Plant plant;
  ProofHelper helper;
};

void expect_push(const Vec3& force_W, const Vec3& along_W) {
  EXPECT_LT((force_W - 15.0 * along_W).norm(), 0.5) << force_W.transpose();  // the handle yields by some 0.1 mm
}

TEST(ProofHelper, PushesAlongXThenYThenXAgainEachTimeTheArmHasStoodForTwoSeconds) {
  HelpedArm arm;
  arm.enable();
  EXPECT_EQ(arm.after(1900), Vec3::Zero());
  expect_push(arm.after(1100), Vec3::UnitX());
  EXPECT_EQ(arm.after(2000), Vec3::Zero());
  expect_push(arm.after(2000), Vec3::UnitY());
  EXPECT_EQ(arm.after(2000), Vec3::Zero());
  expect_push(arm.after(2000), Vec3::UnitX());
}

TEST(ProofHelper, WaitsForTwoSecondsMoreWhenTheArmMovesAndLetsGoOfOneThatDoes) {
  HelpedArm arm;
  arm.enable();
  arm.after(1500);
  arm.turn(0);
  EXPECT_EQ(arm.after(1900), Vec3::Zero());
  expect_push(arm.after(1100), Vec3::UnitX());
  arm.turn(0);
  EXPECT_EQ(arm.after(1), Vec3::Zero());
}

TEST(ProofHelper, TouchesNoArmWhoseDrivesAreOffAndBeginsAnewWithTheNextProof) {
  HelpedArm arm;
  EXPECT_EQ(arm.after(3000), Vec3::Zero());
  arm.enable();
  expect_push(arm.after(3000), Vec3::UnitX());
  arm.plant.servo(5).disable();
  EXPECT_EQ(arm.after(3000), Vec3::Zero());
  arm.enable();
  expect_push(arm.after(3000), Vec3::UnitX());
}

}  // namespace
}  // namespace proxarm::sim
