// Writes a cell as a file that people read and change.
#pragma once

#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// The text has the keys that a new cell needs, with what to look up for a real arm. Files are named relative to the
// cell. `remarks` become comments at the top.
std::string cell_text(const description::Cell& cell, const std::vector<std::string>& remarks, bool with_scene,
                      const std::string& sensor_keys);

}  // namespace proxarm::command_line
