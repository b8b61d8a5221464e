// From a URDF or xacro as makers publish it to the chain of one to seven joints that proxarm moves.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/new_cell/new_cell.hpp"

namespace proxarm::command_line {

struct ChainJoint {
  std::string name;
  bool slides = false;
  std::array<double, 2> range{};  // rad or m: the URDF's limits less a little
  double max_speed = 0.0;         // 0: not said
  double max_effort = 0.0;        // Nm or N; 0: not said
};

struct ArmSource {
  std::string name;                  // of the robot
  std::string tip;                   // link that carries the sensor
  std::vector<ChainJoint> joints;    // outwards from the base
  std::string urdf;                  // what is written: the chain's joints move, all others are fixed
  std::vector<std::string> remarks;  // what was changed and estimated, a line each
};

// Reads the file, by the program xacro where it is one, and makes a URDF of it that an arm can be built from:
//   - The chain goes from the root to --tip. Without it, it goes to where the moving joints end or branch (a gripper's
//     fingers), and there to the link that is called tool0 or flange, if there is one.
//   - Joints beside the chain, mimic ones among them, are fixed at their zero.
//   - Links on the chain without an <inertial> that a body has get an estimate (link_inertia.hpp).
//   - Meshes are named by their places (package:// by --package and ROS_PACKAGE_PATH). Those that can't be drawn are
//     left out.
// Throws SetupError.
ArmSource read_arm(const NewCellOptions& options);

}  // namespace proxarm::command_line
