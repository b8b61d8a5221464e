// Writes a cell as the text of a file that people will read and change.
#pragma once

#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Returns the cell's text. It has the keys that a new cell needs, with comments that say what to look up for a real
// arm. Files are named relative to the cell. `remarks` become comments at the top. `with_scene`: the cell has a scene
// of its own. `sensor_keys` are further lines for the section `sensor`.
std::string cell_text(const description::Cell& cell, const std::vector<std::string>& remarks, bool with_scene,
                      const std::string& sensor_keys);

}  // namespace proxarm::command_line
