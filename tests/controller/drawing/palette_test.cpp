#include "controller/drawing/palette.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

namespace proxarm::controller {
namespace {

using Vec3 = Eigen::Vector3d;

// sRGB to linear light (IEC 61966-2-1).
Vec3 linear(const Rgb& c) {
  const auto of = [](double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); };
  return {of(c.r), of(c.g), of(c.b)};
}

// WCAG 2.1, contrast ratio, 1 to 21.
double contrast(const std::string& a, const std::string& b) {
  const auto luminance = [](const std::string& css) { return Vec3(0.2126, 0.7152, 0.0722).dot(linear(on_white(css))); };
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

// Machado, Oliveira and Fernandes, A physiologically-based model for simulation of color vision deficiency (IEEE
// Transactions on Visualization and Computer Graphics 15, 2009), severity 1.0; on linear RGB.
struct Sight {
  const char* name;
  Eigen::Matrix3d sees;
};
const std::vector<Sight>& sights() {
  static const std::vector<Sight> all = [] {
    Eigen::Matrix3d protan, deutan;
    protan << 0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998;
    deutan << 0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881;
    return std::vector<Sight>{
        {"all cones", Eigen::Matrix3d::Identity()}, {"protanopia", protan}, {"deuteranopia", deutan}};
  }();
  return all;
}

// CIE L*a*b* under D65, as `sight` sees it.
Vec3 lab(const std::string& css, const Sight& sight) {
  Eigen::Matrix3d xyz_of;
  xyz_of << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041;
  const Vec3 seen = (sight.sees * linear(on_white(css))).cwiseMax(0.0).cwiseMin(1.0);
  const Vec3 white(0.95047, 1.0, 1.08883), share = (xyz_of * seen).cwiseQuotient(white);
  const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
  return {116.0 * f(share.y()) - 16.0, 500.0 * (f(share.x()) - f(share.y())), 200.0 * (f(share.y()) - f(share.z()))};
}

// CIE 1976. Two colours side by side are told apart from 2.3 on; thin lines apart from each other need several times
// that.
constexpr double apart = 15.0;
double difference(const std::string& a, const std::string& b, const Sight& sight) {
  return (lab(a, sight) - lab(b, sight)).norm();
}

// Two things that stand in one picture and have no shape, place or dash that tells them apart as well.
const std::vector<std::vector<const char*>> together{{"proxy", "tool", "hand", "slip"},
                                                     {"stick", "slip", "hand", "soft", "ink"},
                                                     {"stick", "slip", "bad", "soft", "ink"},
                                                     {"good", "hand", "ink"},
                                                     {"margin-1", "margin-2", "margin-3", "margin-4"}};
const std::vector<const char*> marks{"proxy", "tool",   "hand",     "stick",    "slip",     "good",
                                     "bad",   "accent", "margin-1", "margin-2", "margin-3", "margin-4"};

TEST(Palette, TextIsReadable) {  // WCAG 2.1, 1.4.3
  for (const bool dark : {false, true}) {
    const auto of = [dark](const char* name) { return std::string(dark ? colour(name).dark : colour(name).light); };
    for (const char* ground : {"paper", "card", "world-top", "world-bottom"}) {
      for (const char* text : {"ink", "soft"}) {
        EXPECT_GE(contrast(of(text), of(ground)), 4.5) << text << " on " << ground << (dark ? ", dark" : ", light");
      }
    }
    for (const char* text : {"good", "bad", "accent"}) EXPECT_GE(contrast(of(text), of("card")), 4.5) << text;
    EXPECT_GE(contrast(of("bad"), of("bad-paper")), 4.5);
  }
}

TEST(Palette, WhatIsDrawnStandsOutFromItsGround) {  // WCAG 2.1, 1.4.11
  for (const bool dark : {false, true}) {
    const auto of = [dark](const char* name) { return std::string(dark ? colour(name).dark : colour(name).light); };
    for (const char* ground : {"paper", "card", "world-top", "world-bottom"}) {
      for (const char* mark : marks) {
        EXPECT_GE(contrast(of(mark), of(ground)), 3.0) << mark << " on " << ground << (dark ? ", dark" : ", light");
      }
    }
  }
  for (const LineStyle& line : line_styles())
    EXPECT_GE(contrast(colour(line.colour).light, "#ffffff"), 3.0) << line.name;
  for (const SeriesStyle& s : series_styles()) EXPECT_GE(contrast(s.colour, "#ffffff"), 3.0) << s.colour;
}

TEST(Palette, ColoursStayApartWithoutRedOrGreenCones) {
  for (const Sight& sight : sights()) {
    for (const bool dark : {false, true}) {
      for (const auto& group : together) {
        for (std::size_t i = 0; i < group.size(); ++i) {
          for (std::size_t j = 0; j < i; ++j) {
            const Colour &a = colour(group[i]), &b = colour(group[j]);
            EXPECT_GE(difference(dark ? a.dark : a.light, dark ? b.dark : b.light, sight), apart)
                << a.name << " and " << b.name << ", " << sight.name << (dark ? ", dark" : ", light");
          }
        }
      }
    }
    const auto series = series_styles();
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GE(difference(series[i].colour, series[j].colour, sight), apart) << i << " and " << j << sight.name;
    }
  }
}

TEST(Palette, SeriesDifferInDashAndMarkAsWell) {
  const auto series = series_styles();
  for (std::size_t i = 0; i < series.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NE(gnuplot_dash(series[i].dash), gnuplot_dash(series[j].dash)) << i << " and " << j;
      EXPECT_NE(series[i].mark, series[j].mark) << i << " and " << j;
    }
  }
}

// Maps are read by lightness: no two steps look alike to anybody, nor in grey.
TEST(Palette, AMapGetsDarkerStepByStep) {
  for (const Sight& sight : sights()) {
    double before = 101.0;
    for (const char* step : map_colours()) {
      const double lightness = lab(step, sight).x();
      EXPECT_LT(lightness, before - 4.0) << step << ", " << sight.name;
      before = lightness;
    }
  }
}

TEST(Palette, ThePageAndThePlotsGetTheSame) {
  const std::string page = palette_css();
  EXPECT_NE(page.find(" --slip: #cc5500;"), std::string::npos);
  EXPECT_NE(page.find(" --line-contact: #0072b2;"), std::string::npos);
  EXPECT_NE(page.find(" --dash-proxy: 7 4;"), std::string::npos);
  EXPECT_NE(page.find(" --dash-tool: 0;"), std::string::npos);
  EXPECT_EQ(gnuplot_line("proxy"), "lc rgb '#0072b2' dt (7,4)");
  EXPECT_EQ(gnuplot_line("tool"), "lc rgb '#803000' dt solid");
  EXPECT_EQ(css(on_white("#00000080")), "#7f7f7f");
}

}  // namespace
}  // namespace proxarm::controller
