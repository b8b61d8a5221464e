// Charts of the studies: panels of curves with labelled axes, and maps of numbers as colours. Curves differ in dash,
// width and mark as well as in colour.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::studies {

struct Curve {
  std::string name{};  // in the key; empty: not in it
  std::vector<double> x{}, y{};
  int style = 0;       // curves of one style look the same; any number from 0
  bool marks = false;  // a mark at each point, on top of the line
  bool line = true;
};

struct Panel {
  std::string title{}, x_label{}, y_label{};
  bool log_x = false, log_y = false;
  std::vector<Curve> curves{};
  bool key = true;
  double x_low = 0.0, x_high = 0.0;  // equal: as the data are
  double y_low = 0.0, y_high = 0.0;
  std::vector<std::string> x_names{};  // x counts these, from 0
  std::vector<double> levels{};        // of y: each a faint line with its value in per cent
};

struct Chart {
  std::string title{};
  int columns = 1;  // panels side by side
  int panel_width = 900, panel_height = 420;
  std::vector<Panel> panels{};
  // One key for all panels below them, of the first panel's curves.
  bool common_key = false;
};

// Writes the SVG. Returns a warning in one line where that didn't work; empty when it did.
[[nodiscard]] std::string draw(const Chart& chart, const std::filesystem::path& svg);

// z over x and y, each a grid's lines; values that aren't finite stay grey.
struct Map {
  std::string title{}, x_label{}, y_label{};  // what z is stands in the chart's title
  bool log_x = false, log_y = false, log_z = false;
  std::vector<double> x{}, y{};  // rising
  std::vector<double> z{};       // x changes first
};

struct MapChart {
  std::string title{};
  int columns = 1;
  std::vector<Map> maps{};
  double z_low = 0.0, z_high = 0.0;  // equal: as the data are
  std::vector<double> contours{};    // values of z at which lines are drawn, each with its value where there is room
  std::string note{};                // below: what grey is
};

[[nodiscard]] std::string draw(const MapChart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
