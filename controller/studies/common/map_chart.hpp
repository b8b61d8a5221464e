// Maps of a study: z over x and y as coloured cells, one for each point of a grid.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/chart.hpp"

namespace proxarm::studies {

// Values of z that aren't finite stay grey.
struct Map {
  std::vector<std::string> title{};  // its lines
  std::string x_label{}, y_label{};
  std::vector<double> x{}, y{};  // a grid's lines, rising; drawn logarithmically
  std::vector<double> z{};       // x changes first
  std::vector<Note> notes{};
};

struct MapChart {
  std::string title{}, subtitle{}, note{};  // note: below; what grey is
  std::string z_label{};                    // along the scale of colours
  double z_least = 0.0;                     // less isn't told apart
  int columns = 1, width = 1000, panel_height = 210;
  std::vector<double> x_ticks{}, y_ticks{};
  std::vector<Map> maps{};
};

// From where to where the scale of colours goes, in half decades, so that it holds what is finite in all maps.
struct Scale {
  double low = 1.0, high = 10.0;
  bool goes_below = false;  // some values are less than z_least
};
Scale scale_of(const MapChart& chart);

// Writes the SVG. Returns a warning in one line where that didn't work; empty when it did.
[[nodiscard]] std::string draw(const MapChart& chart, const std::filesystem::path& svg);

}  // namespace proxarm::studies
