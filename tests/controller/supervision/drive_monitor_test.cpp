#include "controller/supervision/drive_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>

#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;

constexpr int joint = 1;

// One drive of the default arm is sent what a test says and reports what a test says; the others stand.
struct DriveMonitorTest : ::testing::Test {
  // Cycles until a fault, from the first on; 0: none. `setpoint` and `report` are of the time, from where it starts.
  int found_after(const std::function<double(double)>& setpoint, const std::function<double(double)>& report,
                  double for_s = 2.0) {
    DriveMonitor monitor(arm, cell.drives, cell.limits.following_error_rad);
    const JointVector start_rad = arm.start_rad(), no_feedback_s = JointVector::Zero(6);
    JointVector sent = start_rad, reported = start_rad;
    for (int k = 1; k * period_s <= for_s; ++k) {
      const double t = (k - 100) * period_s;
      sent[joint] = start_rad[joint] + (t > 0.0 ? setpoint(t) : 0.0);
      reported[joint] = start_rad[joint] + (t > 0.0 ? report(t) : 0.0);
      verdict = monitor.step({.reported_rad = reported,
                              .link_rad = reported,
                              .setpoint_rad = sent,
                              .feedback_period_s = no_feedback_s,
                              .fresh = is_fresh(k) ? std::uint8_t{0b111111} : std::uint8_t{0b111101},
                              .following = following,
                              .braking = t > brakes_from_s ? std::uint8_t{1u << joint} : std::uint8_t{0},
                              .hand_W = hand_W},
                             waits, period_s);
      if (verdict.fault != Fault::none) return k - 100;
    }
    return 0;
  }

  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  models::Arm arm{cell};
  double period_s = 1e-3;
  std::uint8_t following = 0b111111;
  bool waits = true;
  double brakes_from_s = 1e9;  // by itself
  std::function<bool(int)> is_fresh = [](int) { return true; };
  models::Wrench hand_W;
  DriveVerdict verdict;
};

double stands(double) { return 0.0; }

// A fifth of a second at 30 rad/s² up to 0.7 rad/s and back, again and again.
double swings(double t) { return t > 0.0 ? 0.05 * (1.0 - std::cos(14.0 * t)) : 0.0; }

TEST_F(DriveMonitorTest, FindsNothingInADriveThatFollowsWithinItsLag) {
  for (const double T : {2.5e-4, 1e-3, 4e-3}) {
    period_s = T;
    const double lag_s = following_lag_s(cell.drives[joint], T, 0.0);
    for (const double delay_s : {0.0, 0.5 * lag_s, lag_s}) {
      EXPECT_EQ(found_after(swings, [=](double t) { return swings(t - delay_s); }), 0) << T << " s, " << delay_s;
    }
  }
}

TEST_F(DriveMonitorTest, FindsADriveThatRunsOffWithinMilliseconds) {
  for (const double rad_per_s : {0.1, 0.5, 1.0, -1.0}) {
    const int cycles = found_after(stands, [=](double t) { return rad_per_s * t; });
    EXPECT_EQ(verdict.fault, Fault::drive_deviates);
    EXPECT_EQ(verdict.joint, joint);
    EXPECT_GT(cycles, 0);
    EXPECT_LE(std::abs(rad_per_s) * cycles * period_s, 5.0e-3 + std::abs(rad_per_s) * period_s + 1e-9);
  }
  // More slowly than its fivefold in 20 ms: 1 mrad, and 20 ms.
  EXPECT_NEAR(found_after(stands, [](double t) { return 0.05 * t; }), 20 + 21, 2);
}

TEST_F(DriveMonitorTest, FindsAnEncoderThatIsOffByHalfAgainWhatItMayBe) {
  EXPECT_NEAR(found_after(stands, [](double) { return 1.5e-3; }), 21, 1);
  EXPECT_EQ(verdict.fault, Fault::drive_deviates);
  EXPECT_EQ(found_after(stands, [](double) { return -6e-3; }), 1);
}

TEST_F(DriveMonitorTest, FindsADriveThatGoesTheWrongWay) {
  const int cycles = found_after([](double t) { return 0.1 * t; }, [](double t) { return -0.1 * t; });
  EXPECT_EQ(verdict.fault, Fault::drive_deviates);
  EXPECT_LE(cycles, 32);
}

TEST_F(DriveMonitorTest, LeavesAnOvershootAlone) {
  EXPECT_EQ(found_after(stands, [](double t) { return 1.5e-3 * std::sin(100.0 * t) * std::exp(-20.0 * t); }), 0);
}

TEST_F(DriveMonitorTest, TellsOneThatIsBehindFromOneThatGoesAway) {
  // Its setpoint went on by what it may be ahead, and waits.
  const auto ahead = [](double t) { return std::min(1e-3, 0.1 * t); };
  const int cycles = found_after(ahead, stands);
  EXPECT_EQ(verdict.fault, Fault::drive_blocked);
  EXPECT_NEAR(cycles * period_s, blocked_s, 0.02);
}

TEST_F(DriveMonitorTest, WaitsForAJointThatComesSlowlyNearer) {
  EXPECT_EQ(found_after([](double t) { return std::min(5e-3, t); }, [](double t) { return std::min(5e-3, 2e-3 * t); }),
            0);
}

TEST_F(DriveMonitorTest, CallsNobodyBlockedWhereNoSetpointWaits) {
  waits = false;
  EXPECT_EQ(found_after([](double) { return 1e-3; }, stands), 0);
}

TEST_F(DriveMonitorTest, WaitsLongerForAHandThatHoldsTheJoint) {
  // Axis 2 turns about y, 0.6 m and more from the handle: what it is sent goes forward, the hand pushes back and up.
  hand_W.force = models::Vec3(-4000.0, 0.0, 0.0);
  const auto ahead = [](double t) { return std::min(1e-3, 0.1 * t); };
  models::ToolKinematics at;
  arm.kinematics(arm.start_rad(), at);
  const double torque = at.J_W.col(joint).head<3>().dot(hand_W.force);
  ASSERT_GT(std::abs(torque), 174.0) << "Nm, or the test says little";
  const double towards = torque < 0.0 ? 1.0 : -1.0;
  const int held = found_after([&](double t) { return towards * ahead(t); }, stands, 8.0);
  EXPECT_EQ(verdict.fault, Fault::drive_blocked);
  EXPECT_NEAR(held * period_s, held_by_hand_s, 0.02);
  const int pushed = found_after([&](double t) { return -towards * ahead(t); }, stands, 8.0);
  EXPECT_NEAR(pushed * period_s, blocked_s, 0.02) << "the hand pushes to where it doesn't go";
}

// What waits for a joint that heeds nothing swings with the hand, through where the joint stands: 15 to 20 Hz were
// seen.
TEST_F(DriveMonitorTest, CallsADriveBlockedThatSetpointsPassAgainAndAgain) {
  for (const double f_Hz : {15.0, 20.0}) {
    const auto passes = [=](double t) { return 7e-4 * std::sin(2.0 * M_PI * f_Hz * t); };
    EXPECT_NEAR(found_after(passes, stands) * period_s, blocked_s, 0.06) << f_Hz;
    EXPECT_EQ(verdict.fault, Fault::drive_blocked);
    EXPECT_EQ(found_after(passes, passes), 0) << "it heeds them";
  }
}

TEST_F(DriveMonitorTest, JudgesNoDriveThatTakesNoSetpoints) {
  following = 0b111101;
  EXPECT_EQ(found_after(stands, [](double t) { return t; }), 0);
}

// Speeds up to v, and after 0.2 s brakes by itself at `share` of its deceleration, after a delay.
struct BrakingTest : DriveMonitorTest {
  int found_braking(double v, double share, double delay_s) {
    const double a = cell.drives[joint].max_acceleration_rad_per_s2, up_s = std::abs(v) / a;
    brakes_from_s = 0.2;
    const auto led = [=](double t) {
      const double ramp = std::min(t, up_s);
      return t < 0.0 ? 0.0 : std::copysign(0.5 * a * ramp * ramp, v) + v * std::max(0.0, t - up_s);
    };
    const auto brakes = [=, from_s = brakes_from_s + delay_s](double t) {
      if (t < from_s) return led(t);
      const double s = std::min(t - from_s, std::abs(v) / (share * a));
      return led(from_s) + v * s - std::copysign(0.5 * share * a * s * s, v);
    };
    // Its setpoints aren't heeded any more, wherever they go.
    return found_after([=, this](double t) { return t <= brakes_from_s ? led(t) : 0.0; },
                       [=, lag_s = delay_s](double t) { return brakes(t - lag_s); });
  }
};

TEST_F(BrakingTest, FindsNothingInADriveThatBrakesByItselfAsItWasToldTo) {
  for (const double T : {2.5e-4, 1e-3, 4e-3}) {
    period_s = T;
    const double lag_s = following_lag_s(cell.drives[joint], T, 0.0);
    for (const double v : {0.0, 0.3, -0.3, 2.1, -2.1}) {
      for (const double delay_s : {0.0, 0.25 * lag_s, 0.5 * lag_s}) {
        EXPECT_EQ(found_braking(v, 1.0, delay_s), 0) << T << " s, " << v << " rad/s, " << delay_s << " s";
        EXPECT_EQ(found_braking(v, 3.0, delay_s), 0) << "a harder ramp";
      }
    }
  }
}

// Of its way v²/2a: 6 mrad more are found at once, 2 mrad in 20 ms.
TEST_F(BrakingTest, FindsADriveThatBrakesLessThanItMust) {
  const double a = cell.drives[joint].max_acceleration_rad_per_s2,
               lag_s = following_lag_s(cell.drives[joint], 1e-3, 0.0);
  for (const double v : {1.0, -1.0, 2.1}) {
    const double way_rad = std::pow(std::abs(v) + a * lag_s, 2.0) / (2.0 * a);
    EXPECT_EQ(found_braking(v, 0.5 * v * v / (a * (way_rad + 0.5e-3)), 0.0), 0) << v;
    EXPECT_GT(found_braking(v, 0.5 * v * v / (a * (way_rad + 2e-3)), 0.0), 0) << v;
    EXPECT_EQ(verdict.fault, Fault::drive_deviates);
  }
}

TEST_F(BrakingTest, FindsADriveThatIsToStandAndGoesOffInMilliseconds) {
  brakes_from_s = 0.0;
  const double slack_rad = 0.5 * cell.drives[joint].max_acceleration_rad_per_s2 *
                           std::pow(following_lag_s(cell.drives[joint], period_s, 0.0), 2.0);
  EXPECT_NEAR(slack_rad, 0.65e-3, 0.01e-3) << "as the head says";
  for (const double rad_per_s : {0.5, -0.5}) {
    const int cycles = found_after(stands, [=](double t) { return rad_per_s * t; });
    EXPECT_EQ(verdict.fault, Fault::drive_deviates);
    EXPECT_LE(0.5 * cycles * period_s, 5e-3 + slack_rad + 2e-3);
  }
  EXPECT_EQ(found_after(stands, [=](double) { return 0.95 * (slack_rad + 1e-3); }), 0);
  EXPECT_GT(found_after(stands, [=](double) { return 1.05 * (slack_rad + 1e-3); }), 0);
}

TEST_F(DriveMonitorTest, TakesMissingFeedbackAndItsCatchingUpForNothing) {
  is_fresh = [](int k) { return k % 10 < 7; };
  double held = 0.0;
  int k = 0;
  const auto late = [&](double t) {
    if (++k % 10 < 7) held = swings(t - 3e-3);
    return held;
  };
  EXPECT_EQ(found_after(swings, late), 0);
}

// Six joints a little away each: none by much, the tool by more than it may be.
TEST_F(DriveMonitorTest, AddsUpWhatJointsAreAwayAtTheTool) {
  DriveMonitor monitor(arm, cell.drives, 2.5e-3);
  const JointVector start_rad = arm.start_rad(), no_feedback_s = JointVector::Zero(6);
  JointVector reported = start_rad;
  DriveReports now{.reported_rad = reported,
                   .link_rad = start_rad,
                   .setpoint_rad = start_rad,
                   .feedback_period_s = no_feedback_s,
                   .fresh = 0b111111,
                   .following = 0b111111,
                   .hand_W = {}};
  EXPECT_EQ(monitor.step(now, true, period_s).fault, Fault::none);
  reported[1] += 6e-3;
  reported[2] += 6e-3;
  EXPECT_EQ(monitor.step(now, true, period_s).fault, Fault::drive_deviates);
}

}  // namespace
}  // namespace proxarm::controller
