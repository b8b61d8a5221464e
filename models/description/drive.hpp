// The entries of a cell's `drives`, with what all of them share in its `drive_defaults` and `simulation_defaults`.
#pragma once

#include <string_view>
#include <vector>

#include "models/description/cell.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// The entries in their order. A key that an entry doesn't have is looked for in `drive_defaults`, one that its
// `simulation` doesn't have in `simulation_defaults`. Throws SetupError.
std::vector<YamlNode> drive_nodes(const YamlNode& root);

// Whether a key, dotted from the root, stands in one of these two.
bool is_shared(std::string_view dotted) noexcept;

// What such an entry says. Throws SetupError.
DriveDescription read_drive(const YamlNode& node);

}  // namespace proxarm::description
