// Inertia of links whose URDF has none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/new_cell/urdf_tree.hpp"

namespace proxarm::command_line {

// Links on the path that move and whose <inertial> is missing, or is none that a body has, get that of a rod from their
// joint to the next one, with the mass that the file says. Where it says none, it is a share of the arm's: `arm_kg`, or
// 40 kg at a reach of a metre, growing with its cube. A link's share is its length plus a tenth of the reach, times
// 0.75 for each joint before it. What was estimated is told in `remarks`, and in the file.
void estimate_inertia(UrdfTree& tree, const UrdfTree::Path& path, std::optional<double> arm_kg,
                      std::vector<std::string>& remarks);

}  // namespace proxarm::command_line
