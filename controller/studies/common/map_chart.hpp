// Draws a study's maps: z over x and y as coloured cells, one for each point of a grid.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/chart.hpp"

namespace proxarm::studies {

// Cells with infinite or NaN z stay grey.
struct Map {
  std::vector<std::string> title{};  // lines of the title
  std::string x_label{}, y_label{};
  std::vector<double> x{}, y{};  // the grid's lines, rising; drawn logarithmically
  std::vector<double> z{};       // x changes first
  std::vector<Note> notes{};
};

struct MapChart {
  std::string title{}, subtitle{}, note{};  // note: below the maps; says what grey means
  std::string z_label{};                    // beside the scale of colours
  double z_least = 0.0;                     // smaller z get the colour of this one
  int columns = 1, width = 1000, panel_height = 210;
  std::vector<double> x_ticks{}, y_ticks{};
  std::vector<Map> maps{};
};

// The range of the scale of colours, in half decades, wide enough for all finite z.
struct Scale {
  double low = 1.0, high = 10.0;
  bool goes_below = false;  // some z are less than z_least
};
Scale scale_of(const MapChart& chart);

// Writes the SVG. Returns a warning of one line if that failed, else "".
[[nodiscard]] std::string draw(const MapChart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
