// Colours and line styles of everything that is drawn: the view's page, plots of runs, charts of studies, messages.
//
// Each thing that is drawn has one name, and by that name one colour and one dash wherever it appears. Colours stay
// apart for readers with protanopia and deuteranopia, and from the ground that they lie on (WCAG 2.1, 1.4.3
// and 1.4.11): tests/controller/drawing/palette_test.cpp computes both of this table.
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

// As CSS writes it: #rrggbb, or #rrggbbaa where it lets the ground through.
struct Colour {
  const char* name;
  const char* light;  // on a light ground; plots are drawn on white
  const char* dark;
};

// A line: its colour, by name, and its dash in pixels (line, gap …; the rest 0; all 0: solid).
struct LineStyle {
  const char* name;
  const char* colour;
  std::array<double, 4> dash;
};

// A curve of a study's chart, by number: dash and mark alone tell it from any other.
struct SeriesStyle {
  const char* colour;
  double width;
  std::array<double, 6> dash;
  int mark;  // gnuplot's point type
};

std::span<const Colour> colours() noexcept;
std::span<const LineStyle> line_styles() noexcept;
std::span<const SeriesStyle> series_styles() noexcept;
// The colours of a map, from its least to its largest value, each lighter than the next: told apart without hue, too.
std::span<const char* const> map_colours() noexcept;

// Precondition: the table has it.
const Colour& colour(std::string_view name);
const LineStyle& line_style(std::string_view name);

// "#rrggbb" or "#rrggbbaa", laid on white.
Rgb on_white(std::string_view css) noexcept;
// "#rrggbb" of it.
std::string css(const Rgb& colour);

// Custom properties of the page: --NAME for each colour, --line-NAME and --dash-NAME for each line, in light and, under
// :root[data-theme="dark"], in dark.
std::string palette_css();

// "dt solid" or "dt (6,4)", for gnuplot.
std::string gnuplot_dash(std::span<const double> dash);
// "lc rgb '#b35900' dt (6,4)": the line as it is on white.
std::string gnuplot_line(std::string_view name);

}  // namespace proxarm::controller
