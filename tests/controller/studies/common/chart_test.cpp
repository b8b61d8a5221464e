#include "controller/extras/studies/common/chart.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/common/map_chart.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::studies {
namespace {

TEST(ChartText, NumbersHaveTheirDigitsAndNoExponent) {
  EXPECT_EQ(number_text(878.76, 3), "879");
  EXPECT_EQ(number_text(1357.2, 3), "1360");
  EXPECT_EQ(number_text(0.97909, 2), "0.98");
  EXPECT_EQ(number_text(9.96, 2), "10");
  EXPECT_EQ(number_text(1.0, 3), "1");
  EXPECT_EQ(number_text(-0.42, 3), "-0.42");
  EXPECT_EQ(number_text(1e6, 2), "1000000");
  EXPECT_EQ(number_text(0.0, 2), "0");
  EXPECT_EQ(number_text(3.14e-7, 2), "3.1e-07");
}

TEST(ChartText, CountsAreGroupedByThousands) {
  EXPECT_EQ(count_text(0.0), "0");
  EXPECT_EQ(count_text(999.0), "999");
  EXPECT_EQ(count_text(99224.0), "99,224");
  EXPECT_EQ(count_text(1e6), "1,000,000");
}

TEST(ChartText, LinesBreakAtBlanksAndNotBetweenANumberAndItsUnit) {
  EXPECT_EQ(wrapped("up to 6.6 Hz of it", 10), (std::vector<std::string>{"up to", "6.6 Hz of", "it"}));
  EXPECT_EQ(wrapped("", 10), std::vector<std::string>{});
  EXPECT_EQ(wrapped("unbreakable", 4), std::vector<std::string>{"unbreakable"});
  EXPECT_EQ(letters("10 µm"), 5u);
}

TEST(ChartText, NothingInATextIsSpecial) {
  EXPECT_EQ(plain("a_b 'c'"), "'a\\_b ''c'''");
  EXPECT_EQ(stacked({"a_b", "c\"d"}), "\"a\\\\_b\\nc'd\"");
}

TEST(Chart, TitleNotesAndKeyAreInThePicture) {
  const tests::ScratchFolder folder;
  Panel panel{.title = "a panel",
              .x_label = "time (s)",
              .log_y = true,
              .curves = {{.name = "grows", .x = {0.0, 1.0, 2.0}, .y = {1.0, std::nan(""), 3.0}, .marks = true},
                         {.name = "empty"},
                         {.x = {0.0, 2.0}, .y = {0.5, 0.5}}},
              .y_low = 0.1,
              .y_high = 10.0,
              .levels = {{2.0, "limit"}},
              .uprights = {{1.0, "here"}},
              .x_spans = {{0.5, 1.5, "phase"}},
              .y_spans = {{0.1, 0.2, "rounding"}},
              .notes = {{2.0, 3.0, "marked"}, {1.0, 1.0, "said", Note::Side::on, false}}};
  Panel named{.curves = {{.x = {0.0, 1.0}, .y = {1.0, 2.0}}}, .x_names = {"free constant", "slide"}};
  ASSERT_EQ(draw(Chart{.title = "The answer",
                       .subtitle = "of a question",
                       .columns = 2,
                       .first_wide = true,
                       .panels = {panel, named, named},
                       .key = true},
                 folder / "chart.svg"),
            "");
  const std::string svg = tests::text_of(folder / "chart.svg");
  for (const char* text : {"The answer", "of a question", "a panel", "time (s)", "grows", "limit", "here", "phase",
                           "rounding", "marked", "said", "constant", "slide"}) {
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(svg.find("empty"), std::string::npos);
}

MapChart map_of(const std::vector<double>& z) {
  return {
      .title = "Which mass",
      .note = "grey: none",
      .z_label = "mass (kg)",
      .z_least = 0.01,
      .x_ticks = {1.0, 2.0},
      .y_ticks = {100.0},
      .maps = {{.title = {"hand", "delay"}, .x = {1.0, 2.0}, .y = {100.0}, .z = z, .notes = {{1.0, 100.0, "1 kg"}}}}};
}

TEST(MapChart, ItsScaleHoldsAllThatIsFinite) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const Scale scale = scale_of(map_of({0.5, none}));
  EXPECT_LE(scale.low, 0.5);
  EXPECT_GE(scale.high, 0.5);
  EXPECT_FALSE(scale.goes_below);
  const Scale wide = scale_of(map_of({1e-4, 12.0}));
  EXPECT_DOUBLE_EQ(wide.low, 0.01);
  EXPECT_NEAR(wide.high, 31.6, 0.1);
  EXPECT_TRUE(wide.goes_below);
  EXPECT_LT(scale_of(map_of({none, none})).low, scale_of(map_of({none, none})).high);
  EXPECT_LT(scale_of(map_of({1e-4, 1e-4})).low, scale_of(map_of({1e-4, 1e-4})).high);
}

TEST(MapChart, IsDrawnWithCellsAndWithout) {
  const tests::ScratchFolder folder;
  const double none = std::numeric_limits<double>::quiet_NaN();
  for (const double z : {0.5, none}) {
    ASSERT_EQ(draw(map_of({z, none}), folder / "map.svg"), "");
    const std::string svg = tests::text_of(folder / "map.svg");
    for (const char* text : {"Which mass", "grey: none", "mass (kg)", "hand", "delay", "1 kg"}) {
      EXPECT_NE(svg.find(text), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace proxarm::studies
