// The entries of a cell's `drives`, with what all of them share in its `drive_defaults` and `simulation_defaults`.
#pragma once

#include <vector>

#include "models/description/cell.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// The entries in their order. A key that an entry doesn't have is looked for in `drive_defaults`, one that its
// `simulation` doesn't have in `simulation_defaults`. Throws SetupError.
std::vector<YamlNode> drive_nodes(const YamlNode& root);

// The same mistake, of a value that such an entry may have from one of these two: what is wrong for one drive may be
// right for another, so the message names the drive.
SetupError of_drive(const YamlNode& entry, const SetupError& mistake);

// What such an entry says. Throws SetupError.
DriveDescription read_drive(const YamlNode& node);

}  // namespace proxarm::description
