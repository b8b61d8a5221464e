#include "controller/supervision/tool_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;
constexpr unsigned missed_cycles = 3;

description::CellLimits boxed() {
  description::CellLimits limits;
  limits.workspace_min_m = {0.0, -1.0, -1.0};
  limits.workspace_max_m = {1.0, 1.0, 1.0};
  limits.keep_out.push_back({{0.5, 0.0, 0.0}, {0.6, 0.1, 0.1}});
  return limits;
}

// Cycles until a tool at this speed is found; 0: not within a second.
int found_after(double m_per_s, double period_s) {
  description::CellLimits limits;
  ToolMonitor monitor(limits, missed_cycles, 0.0);
  monitor.start();
  for (int k = 1; k * period_s < 1.0; ++k) {
    if (monitor.step(Vec3(m_per_s * k * period_s, 0.0, 0.0), 0.0, period_s).fault == Fault::tool_too_fast) return k;
  }
  return 0;
}

TEST(ToolMonitor, LetsAToolBeAsFastAsItMayAndAFifthMore) {
  for (const double period_s : {2.5e-4, 1e-3, 4e-3}) {
    EXPECT_EQ(found_after(0.5, period_s), 0);
    EXPECT_EQ(found_after(0.6, period_s), 0);
  }
}

TEST(ToolMonitor, FindsOneThatIsFasterWithinItsWindow) {
  // 13.6 mm at 1 ms.
  EXPECT_EQ(found_after(1.0, 1e-3), 15);
  EXPECT_EQ(found_after(2.0, 1e-3), 8);
  EXPECT_GT(found_after(0.7, 1e-3), 0);
  EXPECT_LE(found_after(0.7, 1e-3), 21);
  EXPECT_LE(found_after(1.0, 2.5e-4) * 2.5e-4, 0.015);
  EXPECT_LE(found_after(1.0, 4e-3) * 4e-3, 0.025);
}

// A soak's session: 4 ms and 0.32 m/s, a hold, and 1 ms within the 80 ms in which the tool had still moved.
TEST(ToolMonitor, TakesNoWayOfALongerPeriodForOneOfAShorter) {
  description::CellLimits limits;
  ToolMonitor monitor(limits, missed_cycles, 0.0);
  monitor.start();
  double x = 0.0;
  for (int k = 0; k < 30; ++k) ASSERT_EQ(monitor.step(Vec3(x += 0.32 * 4e-3, 0.0, 0.0), 0.0, 4e-3).fault, Fault::none);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(monitor.step(Vec3(x, 0.0, 0.0), 0.0, 1e-3).fault, Fault::none) << k;
  int k = 1;
  while (monitor.step(Vec3(x += 2.0 * 1e-3, 0.0, 0.0), 0.0, 1e-3).fault == Fault::none) ++k;
  EXPECT_EQ(k, 7) << "ms until 13.6 mm at 2 m/s";
}

// By the sum of what the furthest joint has gone; with the tool still, whose limit is another.
int elbow_found_after(double m_per_s, double limit_m_per_s, double period_s) {
  description::CellLimits limits;
  limits.max_elbow_speed_m_per_s = limit_m_per_s;
  ToolMonitor monitor(limits, missed_cycles, 0.0);
  monitor.start();
  for (int k = 0; k * period_s < 1.0; ++k) {
    const ToolVerdict verdict = monitor.step(Vec3::Zero(), m_per_s * period_s, period_s);
    if (verdict.fault == Fault::none) continue;
    EXPECT_EQ(verdict.fault, Fault::elbow_too_fast);
    EXPECT_GT(verdict.value, verdict.limit);
    return k;
  }
  return 0;
}

TEST(ToolMonitor, HoldsTheElbowToItsOwnLimit) {
  for (const double period_s : {2.5e-4, 1e-3, 4e-3}) {
    EXPECT_EQ(elbow_found_after(0.1, 0.1, period_s), 0);
    EXPECT_EQ(elbow_found_after(0.12, 0.1, period_s), 0) << "a fifth more";
    EXPECT_EQ(elbow_found_after(0.5, 0.5, period_s), 0);
  }
  // 1.2 · 0.1 m/s · 20 ms + 0.1 m/s · 3 ms + 0.1 mm = 2.8 mm, as the tool's at that limit.
  EXPECT_EQ(elbow_found_after(0.5, 0.1, 1e-3), 6);
  EXPECT_GT(elbow_found_after(0.15, 0.1, 1e-3), 0);
  EXPECT_LE(elbow_found_after(0.15, 0.1, 1e-3), 21);
}

// A joint that was carried far in one cycle of another period, or before the start, isn't counted.
TEST(ToolMonitor, ForgetsTheElbowsWayAsItDoesTheTools) {
  description::CellLimits limits;
  ToolMonitor monitor(limits, missed_cycles, 0.0);
  monitor.start();
  for (int k = 0; k < 30; ++k) ASSERT_EQ(monitor.step(Vec3::Zero(), 0.32 * 4e-3, 4e-3).fault, Fault::none);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(monitor.step(Vec3::Zero(), 0.0, 1e-3).fault, Fault::none) << k;
  monitor.start();
  ASSERT_EQ(monitor.step(Vec3::Zero(), 1.0, 1e-3).fault, Fault::none) << "since before it moved";
  for (int k = 0; k < 100; ++k) ASSERT_EQ(monitor.step(Vec3::Zero(), 0.0, 1e-3).fault, Fault::none) << k;
}

TEST(ToolMonitor, TakesMissingFeedbackAndItsCatchingUpForNothing) {
  ToolMonitor monitor({}, missed_cycles, 0.0);
  monitor.start();
  double x = 0.0;
  for (int k = 0; k < 1000; ++k) {
    if (k % 50 < 47) x = 0.5 * T * k;  // three cycles without an answer
    ASSERT_EQ(monitor.step(Vec3(x, 0.0, 0.0), 0.0, T).fault, Fault::none) << k;
  }
}

TEST(ToolMonitor, FindsAToolThatLeavesItsWorkspaceOrEntersAZone) {
  const description::CellLimits limits = boxed();
  for (const Vec3& direction : {Vec3(1.0, 0.0, 0.0), Vec3(0.0, -1.0, 0.0)}) {
    ToolMonitor monitor(limits, missed_cycles, 0.0);
    monitor.start();
    Vec3 p(0.9, -0.9, 0.0);
    ToolVerdict verdict;
    while (verdict.fault == Fault::none && p.norm() < 3.0) verdict = monitor.step(p += 1e-4 * direction, 0.0, T);
    EXPECT_EQ(verdict.fault, Fault::tool_off_limits);
    EXPECT_NEAR(verdict.value, 2.0, 0.11) << "mm";
    EXPECT_NEAR(monitor.off_limits(p), 2.05e-3, 1e-4);
  }
  ToolMonitor monitor(limits, missed_cycles, 0.0);
  monitor.start();
  Vec3 p(0.55, 0.05, -0.01);
  ToolVerdict verdict;
  while (verdict.fault == Fault::none && p.z() < 1.0) verdict = monitor.step(p += Vec3(0.0, 0.0, 1e-4), 0.0, T);
  EXPECT_NEAR(p.z(), 0.002, 1.1e-4);
}

TEST(ToolMonitor, LetsOneThatStartedOutsideStayThereAndComeIn) {
  ToolMonitor monitor(boxed(), missed_cycles, 0.0);
  monitor.start();
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(monitor.step(Vec3(1.05 - 1e-4 * k, 0.0, 0.5), 0.0, T).fault, Fault::none);
  monitor.start();
  (void)monitor.step(Vec3(1.05, 0.0, 0.5), 0.0, T);
  EXPECT_EQ(monitor.step(Vec3(1.0525, 0.0, 0.5), 0.0, T).fault, Fault::tool_off_limits);
}

TEST(ToolMonitor, ForgetsWhereTheToolWasWhenItStartsAnew) {
  ToolMonitor monitor({}, missed_cycles, 0.0);
  monitor.start();
  for (int k = 0; k < 100; ++k) (void)monitor.step(Vec3::Zero(), 0.0, T);
  monitor.start();
  EXPECT_EQ(monitor.step(Vec3(1.0, 0.0, 0.0), 0.0, T).fault, Fault::none);
}

}  // namespace
}  // namespace proxarm::controller
