#include "controller/report/plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "models/geometry/tool_pose.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

bool have_gnuplot() { return std::system("command -v gnuplot > /dev/null 2>&1") == 0; }

// A made-up session: down to a wall, sticking, sliding, leaving.
void fill(PlotBuilder& plot, int cycles, bool contact = true) {
  for (int k = 0; k < cycles; ++k) {
    const double t = 1e-3 * k, s = t / (1e-3 * cycles);
    CycleRecord r;
    r.cycle = static_cast<std::uint64_t>(k);
    r.time_ns = 1'000'000LL * k;
    r.phase = Phase::rendering;
    r.set(RecordFlag::truth);
    const bool touching = contact && s > 0.3 && s < 0.8, sliding = touching && s > 0.45;
    const double z = contact ? (s < 0.3   ? 0.2 * (0.3 - s) / 0.3
                                : s < 0.8 ? 0.0
                                          : 0.3 * (s - 0.8))
                             : 0.1 * std::sin(9 * s);
    const double x = sliding ? 0.25 * (s - 0.45) : s >= 0.8 ? 0.25 * 0.35 : 0.0;
    r.proxy_W_m = {0.9 + x, 0.1, 0.4 + z};
    const double ringing = touching ? 4e-4 * std::exp(-30 * (s - 0.3)) * std::sin(300 * (s - 0.3)) : 0.0;
    r.true_tool_W_m = {0.9 + x - 1e-4, 0.1, 0.4 + z - ringing};
    const double f = touching ? 6.0 + 2.0 * std::sin(8 * s) : 0.0;
    r.force_W_N = {sliding ? 0.3 * f : 0.0, 0.0, touching ? -f : -2.0};
    r.contact_force_W_N = {sliding ? -0.3 * f : 0.0, 0.0, f};
    if (touching && s < 0.3 + 1.5 / cycles) r.contact_force_W_N[2] = 800.0;  // the impact's step
    if (touching) {
      r.contact = sliding ? ContactPhase::slip : ContactPhase::stick;
      r.contacts[0].normal_W = {0.0, 0.0, 1.0};
    }
    plot.add(r);
  }
}

TEST(Plot, DrawsASessionAtAWall) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  PlotBuilder plot("default scene, 4 kg, T = 1 ms");
  fill(plot, 10000);
  EXPECT_EQ(plot.write(folder / "plot.svg"), "");
  const std::string svg = tests::text_of(folder / "plot.svg");
  for (const char* text : {"<svg", "</svg>", "from wall (mm)", "along wall (mm)", "force (N)", "time (s)", "stick",
                           "slip", "tool", "proxy", "default scene, 4 kg, T = 1 ms"}) {
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  }
  EXPECT_LT(svg.size(), 2'000'000u);
  if (const char* keep = std::getenv("PROXARM_KEEP_PLOT"))
    fs::copy_file(folder / "plot.svg", keep, fs::copy_options::overwrite_existing);
}

TEST(Plot, DrawsCoordinatesWhereNothingWasTouched) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  PlotBuilder plot("free");
  fill(plot, 3000, false);
  EXPECT_EQ(plot.write(folder / "plot.svg"), "");
  EXPECT_NE(tests::text_of(folder / "plot.svg").find("z (mm)"), std::string::npos);
}

// Three revolutions about an axis, `lag_rad` of them behind.
constexpr double revolutions = 3.0, lag_rad = 0.02;
const models::Vec3 spun_about(-0.6, -0.8, 0.0);

void spin(PlotBuilder& plot, int cycles) {
  for (int k = 0; k < cycles; ++k) {
    const double angle = -2.0 * std::numbers::pi * revolutions * k / (cycles - 1.0);
    const auto turned = [&](double by) {
      const models::Quaternion q(models::rotation_by(by * spun_about) *
                                 models::rotation_by(models::Vec3(1.0, 2.0, 0.5)));
      return std::array{q.x(), q.y(), q.z(), q.w()};
    };
    CycleRecord r;
    r.time_ns = 1'000'000LL * k;
    r.phase = Phase::rendering;
    r.set(RecordFlag::truth);
    r.proxy_inertia_kg_m2 = 0.1;
    r.proxy_q_W = turned(angle);
    r.true_tool_q_W = turned(k == 0 ? 0.0 : angle + lag_rad);
    r.torque_W_Nm = triple(-0.5 * spun_about + models::Vec3(0.0, 0.0, 7.0));
    r.contact_torque_W_Nm = triple(0.25 * spun_about);
    plot.add(r);
  }
}

TEST(Plot, DrawsTurnAndTorquesOfAToolThatTurns) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  PlotBuilder turning("turning"), held("held");
  spin(turning, 3000);
  fill(held, 3000);
  EXPECT_EQ(turning.write(folder / "turning.svg"), "");
  EXPECT_EQ(held.write(folder / "held.svg"), "");
  for (const char* text : {"turn (°)", "torque (Nm)", "about (0.60, 0.80, 0.00)", "hand", "contact"}) {
    EXPECT_NE(tests::text_of(folder / "turning.svg").find(text), std::string::npos) << text;
  }
  EXPECT_EQ(tests::text_of(folder / "held.svg").find("turn (°)"), std::string::npos);
}

// Judged by what gnuplot is given.
TEST(Plot, FollowsATurnBeyondARevolutionAboutItsAxis) {
  const tests::ScratchFolder folder;
  const fs::path copies = folder / "copies";
  std::ofstream(copies) << "#!/bin/sh\nf=${1%/*}\ncp \"$f/data\" \"$f/plot.svg\"\n";
  fs::permissions(copies, fs::perms::owner_all);
  PlotBuilder plot("spinning", copies.string());
  spin(plot, 9000);  // thinned out twice
  ASSERT_EQ(plot.write(folder / "data"), "");
  std::istringstream lines(tests::text_of(folder / "data"));
  std::string line;
  std::vector<double> before, x;
  double widest = 0.0;
  while (std::getline(lines, line)) {
    std::istringstream numbers(line);
    x.assign(std::istream_iterator<double>(numbers), {});
    ASSERT_EQ(x.size(), 14U);
    if (!before.empty()) widest = std::max(widest, std::abs(x[11] - before[11]));
    before = x;
  }
  const double degrees = 180.0 / std::numbers::pi, step = 360.0 * revolutions / 9000.0;
  EXPECT_LT(widest, 8.1 * step);
  EXPECT_NEAR(x[11], 360.0 * revolutions, 8.0 * step);   // of the last that was kept
  EXPECT_NEAR(x[10] - x[11], -degrees * lag_rad, 1e-2);  // of numbers to six digits
  EXPECT_NEAR(x[12], 0.5, 1e-4);
  EXPECT_NEAR(x[13], -0.25, 1e-4);
}

TEST(Plot, IsTheSameTwice) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  for (const char* name : {"a", "b"}) {
    PlotBuilder plot("twice");
    fill(plot, 2000);
    EXPECT_EQ(plot.write(folder / name), "");
  }
  EXPECT_EQ(tests::text_of(folder / "a"), tests::text_of(folder / "b"));
}

// Names and titles that would be commands to a shell or to gnuplot.
TEST(Plot, TakesNamesAsNames) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  PlotBuilder plot("it's `touch " + (folder / "pwned").string() + "`'; system 'false' #\n\"$x\"");
  fill(plot, 500);
  const fs::path odd = folder / "a b'; touch pwned; 'c.svg";
  EXPECT_EQ(plot.write(odd), "");
  EXPECT_TRUE(fs::exists(odd));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator{}), 1);
}

TEST(Plot, ThinsOutALongSession) {
  if (!have_gnuplot()) GTEST_SKIP() << "gnuplot isn't installed";
  const tests::ScratchFolder folder;
  PlotBuilder plot("long");
  fill(plot, 200000);
  EXPECT_EQ(plot.write(folder / "plot.svg"), "");
  EXPECT_LT(fs::file_size(folder / "plot.svg"), 2'000'000u);
}

TEST(Plot, WarnsInsteadOfFailing) {
  const tests::ScratchFolder folder;
  PlotBuilder nothing("nothing");
  EXPECT_NE(nothing.write(folder / "plot.svg").find("nothing was rendered"), std::string::npos);
  PlotBuilder absent("absent", "no-such-gnuplot");
  fill(absent, 100);
  EXPECT_NE(absent.write(folder / "plot.svg").find("isn't installed"), std::string::npos);
  PlotBuilder failing("failing", "false");
  fill(failing, 100);
  EXPECT_NE(failing.write(folder / "plot.svg").find("failed"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "plot.svg"));
  if (have_gnuplot()) {
    PlotBuilder unwritable("unwritable");
    fill(unwritable, 100);
    EXPECT_NE(unwritable.write(folder / "no/such/folder.svg").find("no plot: "), std::string::npos);
  }
}

}  // namespace
}  // namespace proxarm::controller
