// Estimates the inertia of links whose URDF has none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/extras/new_cell/urdf_tree.hpp"

namespace proxarm::command_line {

// Gives each moving link on the path that has no physical <inertial> the inertia of a rod from the link's joint to the
// next joint. The rod's mass is the link's mass in the file, else a share of the arm's mass. The arm's mass is
// `arm_kg`. If that isn't given, it is 40 kg times the cube of the reach in metres, or less if the joints' efforts
// couldn't lift so much. A link's share is in proportion to the link's length plus a tenth of the reach, times 0.75 for
// each joint before the link. Estimates are listed in `remarks` and marked in the URDF.
void estimate_inertia(UrdfTree& tree, const UrdfTree::Path& path, std::optional<double> arm_kg,
                      std::vector<std::string>& remarks);

}  // namespace proxarm::command_line
