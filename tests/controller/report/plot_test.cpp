#include "controller/report/plot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

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
      r.normal_W = {0.0, 0.0, 1.0};
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
