// Reads the entries of a cell's `drives`, with keys from `drive_defaults` and `simulation_defaults`.
#pragma once

#include <vector>

#include "models/description/cell.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// Returns the entries of `drives` in order. `drive_defaults` supplies the keys that an entry doesn't have, and
// `simulation_defaults` supplies the keys that the entry's `simulation` doesn't have. Throws SetupError.
std::vector<YamlNode> drive_nodes(const YamlNode& root);

// Returns the error with the drive's name added, if it is an error in a default value. A default value that is wrong
// for one drive may be right for another drive.
SetupError of_drive(const YamlNode& entry, const SetupError& mistake);

// Reads one entry of `drives`. Throws SetupError.
DriveDescription read_drive(const YamlNode& node);

}  // namespace proxarm::description
