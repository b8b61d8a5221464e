// Draws a study's maps: z over x and y as the colour of cells, one cell for each point of a grid.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/studies/common/chart.hpp"

namespace proxarm::studies {

// One map. Cells whose z is infinite or NaN stay grey.
struct Map {
  std::vector<std::string> title{};  // the title's lines
  std::string x_label{}, y_label{};
  std::vector<double> x{}, y{};  // places of the grid's lines, rising; drawn logarithmically
  std::vector<double> z{};       // of each grid point; x changes fastest
  std::vector<Note> notes{};
};

struct MapChart {
  std::string title{}, subtitle{}, note{};  // note: text below the maps that says what grey means
  std::string z_label{};                    // label of the scale of colours
  double z_least = 0.0;                     // smaller z are drawn in the colour of this z
  int columns = 1, width = 1000, panel_height = 210;
  std::vector<double> x_ticks{}, y_ticks{};
  std::vector<Map> maps{};
};

// The range of the scale of colours. It is a whole number of half decades, and contains all finite z.
struct Scale {
  double low = 1.0, high = 10.0;
  bool goes_below = false;  // whether some z are smaller than z_least
};
Scale scale_of(const MapChart& chart);

// Writes the maps as SVG. Returns a warning of one line if that failed, else "".
[[nodiscard]] std::string draw(const MapChart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
