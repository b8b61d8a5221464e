// Reads the entries of a cell's `drives`, and their shared keys in `drive_defaults` and `simulation_defaults`.
#pragma once

#include <vector>

#include "models/description/cell.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// The entries in order. `drive_defaults` supplies keys that an entry lacks, `simulation_defaults` keys that its
// `simulation` lacks. Throws SetupError.
std::vector<YamlNode> drive_nodes(const YamlNode& root);

// Adds the drive's name to a mistake in a default value: a value that is wrong for one drive may be right for another.
SetupError of_drive(const YamlNode& entry, const SetupError& mistake);

// Reads one entry. Throws SetupError.
DriveDescription read_drive(const YamlNode& node);

}  // namespace proxarm::description
