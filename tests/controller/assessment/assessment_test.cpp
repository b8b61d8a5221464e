// An assessment's figures against motions whose stops and clamps are known in closed form; no arm is simulated here.
#include "controller/extras/assessment/assessment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "controller/extras/assessment/assessment_report.hpp"
#include "models/base/setup_error.hpp"
#include "tests/source_file.hpp"

namespace proxarm::assessment {
namespace {

using models::Vec3;

constexpr double step_s = 0.25e-3;

// A tool that runs at `speed` along a direction and, from `stop_s` on, slows down evenly until it stands.
TrialResult even_stop(const Vec3& direction, double speed, double stop_s, double deceleration, double until_s = 2.0) {
  TrialResult result;
  result.stopped_at_s = stop_s;
  for (double t = 0.0; t < until_s; t += step_s) {
    const double braked = std::max(0.0, std::min(t - stop_s, speed / deceleration));
    const double way = speed * std::min(t, stop_s) + speed * braked - 0.5 * deceleration * braked * braked;
    result.samples.push_back({t, way * direction, (speed - deceleration * braked) * direction});
  }
  return result;
}

TEST(StopFigure, IsTimeAndDistanceOfAnEvenStop) {
  const StopFigure figure = stop_figure(even_stop(Vec3::UnitY(), 0.5, 0.7, 2.0));
  EXPECT_NEAR(figure.from_m_per_s, 0.5, 1e-3);
  EXPECT_NEAR(figure.distance_m, 0.5 * 0.5 / (2.0 * 2.0), 2e-4);  // v²/2a; a step is 0.125 mm
  // v/a, less the time of the last millimetre.
  EXPECT_NEAR(figure.time_s, 0.5 / 2.0 - std::sqrt(2.0 * stopped_within_m / 2.0), 2.0 * step_s);
  EXPECT_TRUE(figure.at_rest);
}

TEST(StopFigure, SaysThatTheToolStillMovesWhereTheTrialEnds) {
  EXPECT_FALSE(stop_figure(even_stop(Vec3::UnitY(), 0.5, 0.7, 0.1)).at_rest);
}

// A tool that comes back has been further away than it is in the end.
TEST(StopFigure, DistanceIsTheFarthestNotTheLast) {
  TrialResult result;
  result.stopped_at_s = 0.0;
  for (double t = 0.0; t < 1.0; t += step_s) {
    result.samples.push_back({t, Vec3(0.02 * std::sin(M_PI * std::min(1.0, 2.0 * t)), 0.0, 0.0), Vec3::Zero()});
  }
  EXPECT_NEAR(stop_figure(result).distance_m, 0.02, 1e-6);
}

// A mass m that meets a spring k with v: it goes v √(m/k) deep, pushes with v √(k m), and gives it m v²/2.
TEST(ClampFigure, IsPeakForceAndEnergyOfAMassOnASpring) {
  const double m = 10.0, k = 75e3, v = 0.25, omega = std::sqrt(k / m);
  TrialResult result;
  for (double t = -0.1; t < M_PI / omega + 1.0; t += step_s) {
    const double x = t < 0.0 ? v * t : t < M_PI / omega ? v / omega * std::sin(omega * t) : -v * (t - M_PI / omega);
    const double speed = t < 0.0 ? v : v * std::cos(omega * t);
    result.samples.push_back({t, Vec3(1.0, 0.0, 0.3) + x * Vec3::UnitZ(), speed * Vec3::UnitZ()});
  }
  const Body body{k, Vec3(1.0, 0.0, 0.3), Vec3::UnitZ(), false};
  const ClampFigure figure = clamp_figure(body, result);
  EXPECT_NEAR(figure.transient_N, v * std::sqrt(k * m), 1e-2 * v * std::sqrt(k * m));
  EXPECT_NEAR(figure.energy_J, 0.5 * m * v * v, 1e-2 * m * v * v);
  EXPECT_EQ(figure.quasi_static_N, 0.0) << "it left before half a second was over";
  EXPECT_NEAR(figure.at_m_per_s, v, 1e-3);
}

TEST(ClampFigure, WhatStillPressesAfterHalfASecondIsQuasiStatic) {
  TrialResult result;
  for (double t = 0.0; t < 1.5; t += step_s) {
    // 4 mm deep at first, 1 mm later: 300 N, and 75 N.
    const double x = t < 0.1 ? -1e-3 : t < 0.3 ? 4e-3 : 1e-3;
    result.samples.push_back({t, Vec3(x, 0.0, 0.0), Vec3::Zero()});
  }
  const ClampFigure figure = clamp_figure({75e3, Vec3::Zero(), Vec3::UnitX(), true}, result);
  EXPECT_NEAR(figure.transient_N, 300.0, 1e-9);
  EXPECT_NEAR(figure.quasi_static_N, 75.0, 1e-9);
}

// Each pose and direction is led once undisturbed; the body begins where the tool was fastest, across its way.
TEST(Assess, PutsTheBodyWhereTheToolIsFastestAndTellsTheWorst) {
  int free_runs = 0, bodies = 0;
  const auto arm = [&](const Trial& trial) {
    // Faster in the second pose, and towards -y.
    const double speed = 0.1 + 0.1 * trial.start_rad[0] + (trial.direction_W.y() < 0.0 ? 0.05 : 0.0);
    if (trial.stop == Stop::none && trial.body.stiffness_N_per_m == 0.0) {
      ++free_runs;
      return even_stop(trial.direction_W, speed, 0.7, 1.0);
    }
    if (trial.stop != Stop::none) {
      TrialResult result = even_stop(trial.direction_W, speed, 0.7, trial.stop == Stop::category_0 ? 0.5 : 1.0);
      return result;
    }
    ++bodies;
    EXPECT_NEAR(trial.body.normal_W.dot(trial.direction_W), 1.0, 1e-12);
    EXPECT_LT(trial.body.surface_W.norm(), 0.7 * speed + 1e-9);
    TrialResult result = even_stop(trial.direction_W, speed, 0.7, 1.0);
    result.end = "somewhere";
    return result;
  };
  const Thresholds thresholds{"", "a source", {{"hands", 75e3, 280.0, 140.0}, {"others", 33e3, 1e9, 1e9}}};
  const Assessment found = assess({{0.0}, {1.0}}, directions_of({}), thresholds, arm);
  EXPECT_EQ(free_runs, 12);
  EXPECT_EQ(bodies, 12 * 2 * 7) << "six stiffnesses, and the one of a region that has its own";
  ASSERT_EQ(found.stops.size(), 3u);
  EXPECT_EQ(found.stops[0].stop, Stop::category_0);
  EXPECT_EQ(found.stops[0].pose, 1);
  EXPECT_EQ(found.stops[0].direction, "-y");
  EXPECT_NEAR(found.stops[0].distance_m, 0.25 * 0.25, 1e-3);        // v²/2a with a = 0.5
  EXPECT_NEAR(found.stops[1].distance_m, 0.5 * 0.25 * 0.25, 1e-3);  // with a = 1
  EXPECT_EQ(exceeded(found, thresholds), std::vector<std::string>{"hands"});
  Subject subject;
  subject.cell = "a cell";
  const std::string told = text(subject, found, thresholds);
  EXPECT_NE(told.find("certifies nothing"), std::string::npos);
  EXPECT_NE(told.find("a source"), std::string::npos);
  EXPECT_NE(told.find("EXCEEDED: hands\n"), std::string::npos);
}

TEST(Poses, StayWithinRangesWorkspaceAndAwayFromSingularities) {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  cell.limits.workspace_min_m = {0.6, -0.1, 0.5};
  cell.limits.workspace_max_m = {0.9, 0.1, 0.9};
  const models::Arm arm(cell);
  const auto poses = poses_about_start(cell, arm, 10);
  ASSERT_EQ(poses.size(), 10u);
  EXPECT_EQ(poses[0], cell.start_rad);
  for (const std::vector<double>& pose : poses) {
    models::JointVector q(6);
    for (int i = 0; i < 6; ++i) {
      q[i] = pose[static_cast<std::size_t>(i)];
      EXPECT_GE(q[i], cell.drives[static_cast<std::size_t>(i)].range_rad[0]);
      EXPECT_LE(q[i], cell.drives[static_cast<std::size_t>(i)].range_rad[1]);
    }
    const Vec3 p = arm.tool_pose(q).translation();
    EXPECT_TRUE(p.x() >= 0.6 && p.x() <= 0.9 && std::abs(p.y()) <= 0.1 && p.z() >= 0.5 && p.z() <= 0.9) << p;
  }
  EXPECT_EQ(poses_about_start(cell, arm, 10), poses) << "the same each time";
}

TEST(ThresholdsFile, TheShippedOneNamesItsSource) {
  const Thresholds thresholds = load_thresholds(source_file("models/thresholds/hands.yaml"));
  EXPECT_NE(thresholds.source.find("ISO/TS 15066:2016, Table A.2"), std::string::npos);
  ASSERT_EQ(thresholds.regions.size(), 1u);
  EXPECT_EQ(thresholds.regions[0].stiffness_N_per_m, 75e3);
  EXPECT_EQ(thresholds.regions[0].transient_N, 280.0);
  EXPECT_EQ(thresholds.regions[0].quasi_static_N, 140.0);
  ASSERT_TRUE(thresholds.vibration);
  EXPECT_NE(thresholds.vibration->source.find("Brisben"), std::string::npos);
  // Lowest between 150 and 200 Hz, as the paper's abstract has it.
  const auto amplitude = [&](double f_Hz) { return thresholds.vibration->amplitude_m(f_Hz).value(); };
  for (const double f_Hz : {10.0, 40.0, 125.0, 250.0, 400.0}) EXPECT_GT(amplitude(f_Hz), amplitude(175.0)) << f_Hz;
  for (double f_Hz = 10.0; f_Hz < 150.0; f_Hz *= 1.1) EXPECT_GT(amplitude(f_Hz), amplitude(1.05 * f_Hz)) << f_Hz;
}

TEST(ThresholdsFile, BetweenTwoPointsOfAVibrationIsAPowerOfTheFrequency) {
  const VibrationThreshold steep{"", {{10.0, 4e-6}, {40.0, 2.5e-7}, {100.0, 2.5e-7}}};
  EXPECT_NEAR(steep.amplitude_m(20.0).value(), 1e-6, 1e-12);  // 12 dB an octave: a quarter at twice the frequency
  EXPECT_EQ(steep.amplitude_m(10.0), 4e-6);
  EXPECT_EQ(steep.amplitude_m(40.0), 2.5e-7);
  EXPECT_NEAR(steep.amplitude_m(70.0).value(), 2.5e-7, 1e-15);
  EXPECT_EQ(steep.amplitude_m(100.0), 2.5e-7);
  EXPECT_FALSE(steep.amplitude_m(9.9));
  EXPECT_FALSE(steep.amplitude_m(101.0));
}

TEST(ThresholdsFile, RefusesPointsOutOfOrder) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "thresholds.yaml";
  const auto refused = [&](const std::string& points) -> std::string {
    std::ofstream(file) << "source: a\nregions:\n"
                           "  - {name: hand, stiffness_N_per_mm: 75, quasi_static_N: 140, transient_N: 280}\n"
                           "vibration:\n  source: b\n  points: "
                        << points << "\n";
    try {
      (void)load_thresholds(file);
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refused("[{frequency_Hz: 10, amplitude_um: 3}, {frequency_Hz: 20, amplitude_um: 1}]"), "");
  const std::string order = refused("[{frequency_Hz: 20, amplitude_um: 3}, {frequency_Hz: 10, amplitude_um: 1}]");
  EXPECT_NE(order.find("sorted by frequency"), std::string::npos) << order;
  EXPECT_NE(refused("[{frequency_Hz: 20, amplitude_um: 3}]").find("vibration.points"), std::string::npos);
  EXPECT_NE(refused("[{frequency_Hz: 20, amplitude_um: 3}, {frequency_Hz: 30, amplitude_um: 0}]").find("amplitude_um"),
            std::string::npos);
}

}  // namespace
}  // namespace proxarm::assessment
