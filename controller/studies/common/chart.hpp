// Draws the studies' charts: panels of curves with labelled axes, and maps of numbers as colours (map_chart.hpp).
// Curves differ in dash, width and mark as well as in colour.
//
// A chart answers one question: its title is the answer, and a note marks the evidence in the picture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::studies {

struct Curve {
  std::string name{};  // in the key; empty: not listed
  std::vector<double> x{}, y{};
  int style = 0;       // curves of one style look alike; any number from 0
  bool marks = false;  // a mark at each point, on top of the line
  bool line = true;
  double mark_size = 0.9;
};

// Text at a point of the data.
struct Note {
  enum class Side : unsigned char { right, left, above, below, on };
  double x = 0.0, y = 0.0;
  std::string text{};
  Side side = Side::right;  // of the point
  bool ring = true;         // around the point
};

// A straight line across the panel at one value of y, or of x.
struct Level {
  double at = 0.0;
  std::string text{};  // right of a line at one y; beside the upper end of a line at one x
};

// A shaded part of the panel between two values of x, or of y.
struct Span {
  double from = 0.0, to = 0.0;
  std::string text{};  // inside, at the upper end
};

struct Panel {
  std::string title{}, x_label{}, y_label{};
  bool log_x = false, log_y = false;
  std::vector<Curve> curves{};
  double x_low = 0.0, x_high = 0.0;  // equal: as the data need
  double y_low = 0.0, y_high = 0.0;
  std::vector<std::string> x_names{};        // x is an index into these
  std::vector<double> x_ticks{}, y_ticks{};  // empty: gnuplot's choice
  std::vector<Level> levels{}, uprights{};   // at values of y; at values of x
  std::vector<Span> x_spans{}, y_spans{};    // of x; of y
  std::vector<Note> notes{};
  std::string title_colour = "ink";  // of the palette
};

struct Chart {
  std::string title{};      // the answer; long ones take several lines
  std::string subtitle{};   // what was measured, and how
  int columns = 1;          // panels side by side
  int width = 1000;         // of the whole chart
  int panel_height = 300;   // of a panel's frame
  bool first_wide = false;  // the first panel has its own row
  std::vector<Panel> panels{};
  bool key = false;  // below the panels, with all curves' names
};

// Writes the SVG. Returns a warning of one line if that failed, else "".
[[nodiscard]] std::string draw(const Chart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
