// Monitored standstill: a joint that moves while the arm is to stand is found in the cycle in which it does.
#include "controller/supervision/standstill_monitor.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <limits>

namespace proxarm::controller {
namespace {

constexpr double T = 1e-3, tolerance_rad = 1e-3;
constexpr std::uint8_t all = 0b111111;
constexpr int settled = 200;  // cycles

struct Standstill : ::testing::Test {
  Standstill() { at.setZero(6); }
  StandstillVerdict step(bool stands = true, std::uint8_t fresh = all) { return monitor.step(at, fresh, stands, T); }
  // Until the place is known: one cycle more than 0.2 s, for sums of 1 ms that round below it.
  void settle() {
    for (int k = 0; k <= settled + 1; ++k) ASSERT_EQ(step().fault, Fault::none);
  }

  models::JointVector at;
  StandstillMonitor monitor{6, tolerance_rad};
};

TEST_F(Standstill, FindsAJointThatMovesInTheVeryCycle) {
  settle();
  at[3] = 0.999 * tolerance_rad;
  EXPECT_EQ(step().fault, Fault::none);
  at[3] = -1.001 * tolerance_rad;
  const StandstillVerdict verdict = step();
  EXPECT_EQ(verdict.fault, Fault::standstill_left);
  EXPECT_EQ(verdict.joint, 3);
  EXPECT_DOUBLE_EQ(verdict.value_rad, 1.001 * tolerance_rad);
  EXPECT_DOUBLE_EQ(verdict.limit_rad, tolerance_rad);
}

// What creeps is found however slowly: the place isn't taken anew.
TEST_F(Standstill, FindsAJointThatCreeps) {
  settle();
  int cycles = 0;
  do {
    at[0] += 1e-7;
    ASSERT_LT(++cycles, 10'002);
  } while (step().fault == Fault::none);
  EXPECT_GE(cycles, 9'999);
}

TEST_F(Standstill, LetsTheArmComeToRestFirst) {
  for (int k = 0; k < settled - 1; ++k) {
    at[1] += 1e-4;
    ASSERT_EQ(step().fault, Fault::none);
  }
  settle();
}

TEST_F(Standstill, BeginsAnewWhenTheArmMayMove) {
  settle();
  at[2] = 1.0;
  EXPECT_EQ(step(false).fault, Fault::none);
  settle();
  at[2] = 1.0 + 2.0 * tolerance_rad;
  EXPECT_EQ(step().fault, Fault::standstill_left);
}

TEST_F(Standstill, AnEncoderThatIsNotHeardIsNotJudged) {
  settle();
  at[5] = 1.0;
  EXPECT_EQ(step(true, 0b011111).fault, Fault::none);
  EXPECT_EQ(step().joint, 5);
}

TEST_F(Standstill, AnAngleThatIsNoNumberIsNoStandstill) {
  settle();
  at[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(step().fault, Fault::standstill_left);
}

TEST_F(Standstill, GoesOnFromItsArchive) {
  settle();
  std::array<std::byte, 128> bytes{};
  auto written = fieldbus::StateArchive::writer(bytes);
  monitor.archive(written);
  ASSERT_TRUE(written.whole());
  StandstillMonitor copy(6, tolerance_rad);
  auto read = fieldbus::StateArchive::reader(std::span<const std::byte>(bytes).first(written.bytes()));
  copy.archive(read);
  ASSERT_TRUE(read.whole());
  at[0] = 2.0 * tolerance_rad;
  EXPECT_EQ(copy.step(at, all, true, T).joint, 0);
}

}  // namespace
}  // namespace proxarm::controller
