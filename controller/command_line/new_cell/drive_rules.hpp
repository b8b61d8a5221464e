// What a drive, its gear and its motor are about like, where no data sheet is at hand.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/new_cell/arm_source.hpp"
#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Fills in the drives of a cell whose arm can be built, one for each joint. By rules of thumb, with I the mean and I'
// the largest inertia that the joint moves over all poses (links and tool), g' the largest torque of gravity:
//   rotor      half of I, as motors are matched to their loads; wrists not below 3 % of the heaviest joint's
//   stiffness  with I alone the gear would swing at 25 Hz, which leaves arms a first mode of 10 to 16 Hz, as industrial
//              ones have; wrists not below a tenth of the stiffest, nor above 150 Hz of their own link
//   damping    a twentieth of what is critical for that
//   torque     what the URDF says (effort), if nine tenths of it bear 1.2 g' and bring the joint to its speed in a
//              third of a second; else what that takes in a 15th of a second, and a hand of 100 N at the tool, which is
//              all that the light wrist of an arm feels
//   friction   1 % of the torque by Coulomb, 0.8 % at 1 rad/s
//   speed      the URDF's (at most 4 rad/s)
//   acceleration  what nine tenths of the torque leave beside 1.2 g' for I' + rotor: to its speed in a 15th of a second
//              at most
// And limits.max_force_N: what nine tenths of each torque hold at the tool beside 1.2 g', with the longest lever; 200 N
// at most, 60 N at least. Returns what to tell of efforts that weren't taken and of weak joints, a line each. Throws
// SetupError, which names the URDF, for an arm that is too large or too heavy for any drive.
std::vector<std::string> size_drives(description::Cell& cell, const std::vector<ChainJoint>& joints,
                                     const std::filesystem::path& urdf);

}  // namespace proxarm::command_line
