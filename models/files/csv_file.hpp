// Reads columns of numbers over time from CSV files: a recorded motion or force.
//
//   time_s,x_m,y_m,z_m        the header names the columns; the file may have other columns too
//   0,0,0,0
//   0.01,0.0002,0,0
//
// The separator is the semicolon, tab or comma that the first line contains. Empty lines, lines that begin with '#' and
// a byte order mark are skipped. Anything that isn't a number is reported as a mistake, with line and column.
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

// The columns of time, x, y and z, as texts. A column is a name in the header, or a number from 1. If all four are
// numbers, the file needs no header.
using CsvColumns = std::array<std::string, 4>;

// Reads rows whose time is strictly increasing, at least two rows and at most a million. `range`: the allowed x, y and
// z. Throws SetupError, with file and line.
std::vector<TimedVector> load_csv(const std::filesystem::path& file, const CsvColumns& columns, Range range);
std::vector<TimedVector> parse_csv(std::string_view text, const std::filesystem::path& file, const CsvColumns& columns,
                                   Range range);

}  // namespace proxarm::description
