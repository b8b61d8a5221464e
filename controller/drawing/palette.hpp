// Colours and line styles of all drawings: the view's page, plots of runs, charts of studies, messages.
//
// Each drawn thing has one name, and one colour and dash wherever it appears. Colours are distinct for readers with
// protanopia and deuteranopia, and from their background (WCAG 2.1, 1.4.3 and 1.4.11):
// tests/controller/drawing/palette_test.cpp computes both for this table.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace proxarm::controller {

struct Rgb {
  double r = 0.0, g = 0.0, b = 0.0;  // sRGB, 0 to 1
};

// As in CSS: #rrggbb, or #rrggbbaa if transparent.
struct Colour {
  const char* name;
  const char* light;  // on a light background; plots are white
  const char* dark;
};

// A line: its colour, by name, and its dash in pixels (line, gap …; the rest 0; all 0: solid).
struct LineStyle {
  const char* name;
  const char* colour;
  std::array<double, 4> dash;
};

// A curve of a study's chart, by number: its dash and mark are unique.
struct SeriesStyle {
  const char* colour;
  double width;
  std::array<double, 6> dash;
  int mark;  // gnuplot's point type
};

std::span<const Colour> colours() noexcept;
std::span<const LineStyle> line_styles() noexcept;
std::span<const SeriesStyle> series_styles() noexcept;
// The colours of a map, from its smallest to its largest value, each lighter than the next, so that they differ also
// without hue.
std::span<const char* const> map_colours() noexcept;

// Precondition: the table contains the name.
const Colour& colour(std::string_view name);
const LineStyle& line_style(std::string_view name);

// "#rrggbb" or "#rrggbbaa", blended with white.
Rgb on_white(std::string_view css) noexcept;
// A colour as "#rrggbb".
std::string css(const Rgb& colour);

// The page's custom properties: --NAME for each colour, --line-NAME and --dash-NAME for each line; light, and under
// :root[data-theme="dark"] dark.
std::string palette_css();

// "dt solid" or "dt (6,4)", for gnuplot.
std::string gnuplot_dash(std::span<const double> dash);
// "lc rgb '#b35900' dt (6,4)": the line on white, for gnuplot.
std::string gnuplot_line(std::string_view name);

}  // namespace proxarm::controller
