// A cell as a file that somebody reads and changes.
#pragma once

#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// The keys that a new cell needs, with what to look up for a real arm. Files are named as they lie beside the cell.
// `remarks` stand at its top.
std::string cell_text(const description::Cell& cell, const std::vector<std::string>& remarks, bool with_scene,
                      const std::string& sensor_keys);

}  // namespace proxarm::command_line
