// Estimates drives, gears and motors without a data sheet.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/new_cell/arm_source.hpp"
#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Fills in the drives of a cell whose arm can be built, one drive for each joint, by rules of thumb. I and I' are the
// mean and the largest inertia of links and tool that the joint moves, over all poses. I_max is the largest I of the
// joints that turn. g' is the largest torque of gravity over all poses.
//   rotor         I/2, because motors are matched to their loads; an I below 3 % of I_max (at wrists) counts as 3 %
//   stiffness     makes the gear swing at 25 Hz with I alone, so that the arm's first mode is at 10 to 16 Hz, as it is
//                 for industrial arms; an I below a tenth of I_max (at wrists) counts as a tenth, but with the link's
//                 own I the gear swings at 150 Hz at most
//   damping       a twentieth of the critical damping
//   torque        the URDF's effort, if nine tenths of it hold 1.2 g' and bring the joint to its speed in a third of a
//                 second; otherwise the torque of which nine tenths hold 1.2 g' and bring the joint to its speed in a
//                 15th of a second, plus the torque of a hand's 100 N at the tool, which is most of a light wrist's
//   friction      Coulomb 1 % of the torque, viscous 0.8 % of the torque at 1 rad/s
//   speed         the URDF's, else 2 rad/s; at most 4 rad/s (for a joint that slides: 0.5 m/s and 1 m/s)
//   acceleration  what nine tenths of the torque less 1.2 g' give to I' + rotor, but at most speed/(1/15 s)
// Sets limits.max_force_N, between 60 and 200 N, to the force at the tool that each drive can hold on its longest lever
// with nine tenths of its torque less 1.2 g'. Returns remarks about refused efforts and weak joints, one line each.
// Throws a SetupError that names the URDF if the arm is too large or too heavy for any drive.
std::vector<std::string> size_drives(description::Cell& cell, const std::vector<ChainJoint>& joints,
                                     const std::filesystem::path& urdf);

}  // namespace proxarm::command_line
