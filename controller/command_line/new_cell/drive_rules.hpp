// Estimates drives, gears and motors without a data sheet.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/new_cell/arm_source.hpp"
#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Fills in the drives of a cell whose arm can be built, one for each joint, by rules of thumb. I and I' are the mean
// and the largest inertia that the joint moves over all poses (links and tool); g' is the largest torque of gravity.
//   rotor      I/2, as motors are matched to their loads; for wrists I isn't below 3 % of the largest I
//   stiffness  with I alone the gear swings at 25 Hz, which gives arms a first mode of 10 to 16 Hz, as industrial ones
//              have; for wrists I isn't below a tenth of the largest I, but the link alone swings at 150 Hz at most
//   damping    a twentieth of the critical damping
//   torque     the URDF's effort, if nine tenths of it bear 1.2 g' and bring the joint to its speed in a third of a
//              second; else what 1.2 g' and reaching the speed in a 15th of a second take, plus 100 N of a hand at the
//              tool, which is nearly all that an arm's light wrist bears
//   friction   Coulomb 1 % of the torque, viscous 0.8 % at 1 rad/s
//   speed      the URDF's, at most 4 rad/s
//   acceleration  what nine tenths of the torque less 1.2 g' give to I' + rotor; at most speed/(1/15 s)
// Sets limits.max_force_N to the force at the tool that nine tenths of each torque less 1.2 g' hold with the longest
// lever, between 60 and 200 N. Returns remarks about refused efforts and weak joints, a line each. Throws SetupError,
// which names the URDF, if the arm is too large or too heavy for any drive.
std::vector<std::string> size_drives(description::Cell& cell, const std::vector<ChainJoint>& joints,
                                     const std::filesystem::path& urdf);

}  // namespace proxarm::command_line
