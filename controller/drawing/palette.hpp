// Colours and line styles of all drawings: the view's page, plots of runs, charts of studies, messages.
//
// Each drawn thing has one name, with one colour and one dash wherever it appears. Readers with protanopia or
// deuteranopia can tell the colours from each other and from their background (WCAG 2.1, 1.4.3 and 1.4.11):
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

// A named colour as in CSS: #rrggbb, or #rrggbbaa if it is transparent.
struct Colour {
  const char* name;
  const char* light;  // colour on a light background, such as that of plots
  const char* dark;
};

// A named line: the name of its colour, and its dash as lengths of line, gap, line, gap in pixels. Unused lengths are
// 0; all 0: a solid line.
struct LineStyle {
  const char* name;
  const char* colour;
  std::array<double, 4> dash;
};

// The curve of a study's chart with this number. Its dash and its mark are unique.
struct SeriesStyle {
  const char* colour;
  double width;
  std::array<double, 6> dash;
  int mark;  // gnuplot's point type
};

std::span<const Colour> colours() noexcept;
std::span<const LineStyle> line_styles() noexcept;
std::span<const SeriesStyle> series_styles() noexcept;
// Returns the colours of a map, from the smallest value to the largest. Each colour is darker than the one before it,
// so that they differ without hue, too.
std::span<const char* const> map_colours() noexcept;

// Precondition: the table contains the name.
const Colour& colour(std::string_view name);
const LineStyle& line_style(std::string_view name);

// Blends "#rrggbb" or "#rrggbbaa" with white.
Rgb on_white(std::string_view css) noexcept;
// Returns a colour as "#rrggbb".
std::string css(const Rgb& colour);

// Returns the page's custom properties as CSS: --NAME for each colour, --line-NAME and --dash-NAME for each line. The
// values for a dark background are under :root[data-theme="dark"].
std::string palette_css();

// Returns a dash for gnuplot: "dt solid" or "dt (6,4)".
std::string gnuplot_dash(std::span<const double> dash);
// Returns a line on white for gnuplot: "lc rgb '#b35900' dt (6,4)".
std::string gnuplot_line(std::string_view name);

}  // namespace proxarm::controller
