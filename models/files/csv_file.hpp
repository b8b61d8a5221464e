// Columns of numbers over time, as tools write them: a recorded motion, a recorded force.
//
//   time_s,x_m,y_m,z_m        the header names the columns; others may stand between them
//   0,0,0,0
//   0.01,0.0002,0,0
//
// Fields end at commas, semicolons or tabs, whichever the first line has. Empty lines and such that begin with '#' are
// skipped, and so is a byte order mark. Whatever isn't a number is a mistake, with its line and column.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "models/files/yaml_file.hpp"

namespace proxarm::description {

struct TimedVector {
  double time_s = 0.0;
  std::array<double, 3> value{};
};

// Which columns hold time, x, y and z: names of the header, or numbers from 1, as texts. With numbers alone, a file
// needs no header.
using CsvColumns = std::array<std::string, 4>;

// Rows in the order of time, each after the one before, at least two and at most a million. Throws SetupError, with
// file and line.
std::vector<TimedVector> load_csv(const std::filesystem::path& file, const CsvColumns& columns, Range range);
std::vector<TimedVector> parse_csv(std::string_view text, const std::filesystem::path& file, const CsvColumns& columns,
                                   Range range);

}  // namespace proxarm::description
