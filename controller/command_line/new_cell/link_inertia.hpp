// Estimates the inertia of links whose URDF has none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/new_cell/urdf_tree.hpp"

namespace proxarm::command_line {

// Moving links on the path without a physical <inertial> get the inertia of a rod from their joint to the next one. Its
// mass is the file's, else a share of the arm's mass: `arm_kg`, or 40 kg times the cube of the reach in metres, or less
// if the joints' efforts couldn't lift that. The share is in proportion to the link's length plus a tenth of the reach,
// times 0.75 for each joint before the link. Estimates are listed in `remarks` and marked in the file.
void estimate_inertia(UrdfTree& tree, const UrdfTree::Path& path, std::optional<double> arm_kg,
                      std::vector<std::string>& remarks);

}  // namespace proxarm::command_line
