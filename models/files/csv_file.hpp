// Reads columns of numbers over time from CSV files: a recorded motion or force.
//
//   time_s,x_m,y_m,z_m        the header names the columns; other columns may stand between them
//   0,0,0,0
//   0.01,0.0002,0,0
//
// The separator is the semicolon, tab or comma found in the first line. Empty lines, lines that begin with '#' and a
// byte order mark are skipped. Anything that isn't a number is a mistake, reported with line and column.
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

// The columns of time, x, y and z: names in the header, or numbers from 1, as texts. With only numbers, a file needs no
// header.
using CsvColumns = std::array<std::string, 4>;

// Rows with strictly increasing time, at least two and at most a million. Throws SetupError, with file and line.
std::vector<TimedVector> load_csv(const std::filesystem::path& file, const CsvColumns& columns, Range range);
std::vector<TimedVector> parse_csv(std::string_view text, const std::filesystem::path& file, const CsvColumns& columns,
                                   Range range);

}  // namespace proxarm::description
