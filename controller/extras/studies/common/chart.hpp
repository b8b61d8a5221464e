// Draws the studies' charts of curves; map_chart.hpp draws maps. Curves differ in dash, width and mark as well as in
// colour.
//
// A chart answers one question. The chart's title is the answer, and a note marks the evidence in the picture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::studies {

struct Curve {
  std::string name{};  // name in the key; empty: not in the key
  std::vector<double> x{}, y{};
  int style = 0;       // a number from 0; curves of one style look alike
  bool marks = false;  // draw a mark at each point, on top of the line
  bool line = true;
  double mark_size = 0.9;
};

// Text at a point of the data.
struct Note {
  enum class Side : unsigned char { right, left, above, below, on };
  double x = 0.0, y = 0.0;
  std::string text{};
  Side side = Side::right;  // the side of the point on which the text is
  bool ring = true;         // draw a ring around the point
};

// A straight line across the panel at one value of y, or of x.
struct Level {
  double at = 0.0;
  std::string text{};  // beside the line: at its right end, or at its upper end
};

// A shaded part of the panel between two values of x, or of y.
struct Span {
  double from = 0.0, to = 0.0;
  std::string text{};  // in the part, at its upper end
};

struct Panel {
  std::string title{}, x_label{}, y_label{};
  bool log_x = false, log_y = false;
  std::vector<Curve> curves{};
  double x_low = 0.0, x_high = 0.0;  // range of the axis; equal: as the data need
  double y_low = 0.0, y_high = 0.0;
  std::vector<std::string> x_names{};        // names at the x axis; a curve's x is then an index into them
  std::vector<double> x_ticks{}, y_ticks{};  // empty: gnuplot's choice
  std::vector<Level> levels{}, uprights{};   // lines at one y; lines at one x
  std::vector<Span> x_spans{}, y_spans{};    // parts between two x; between two y
  std::vector<Note> notes{};
  std::string title_colour = "ink";  // a colour of the palette
};

struct Chart {
  std::string title{};      // the answer; a long title takes several lines
  std::string subtitle{};   // what was measured, and how
  int columns = 1;          // number of panels side by side
  int width = 1000;         // of the whole chart, in pixels
  int panel_height = 300;   // of a panel's frame, in pixels
  bool first_wide = false;  // the first panel has its own row
  std::vector<Panel> panels{};
  bool key = false;  // draw a key with all curves' names below the panels
};

// Writes the chart as SVG. Returns a warning of one line if that failed, else "".
[[nodiscard]] std::string draw(const Chart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
