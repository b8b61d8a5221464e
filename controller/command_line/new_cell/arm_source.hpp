// Converts a maker's URDF or xacro to the chain of one to seven joints that proxarm moves.
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
  std::array<double, 2> range{};  // rad or m: the URDF's limits with a small margin
  double max_speed = 0.0;         // 0: not stated
  double max_effort = 0.0;        // Nm or N; 0: not stated
};

struct ArmSource {
  std::string name;                  // of the robot
  std::string tip;                   // link that carries the sensor
  std::vector<ChainJoint> joints;    // outwards from the base
  std::string urdf;                  // written beside the cell: the chain's joints move, all others are fixed
  std::vector<std::string> remarks;  // changes and estimates, a line each
};

// Reads the file, a xacro through the program xacro, and makes a URDF of it from which an arm can be built:
//   - The chain goes from the root to --tip. Without --tip it goes to where the moving joints end or branch (a
//     gripper's
//     fingers), and on to the link called tool0 or flange there, if any.
//   - Joints beside the chain, mimic joints included, are fixed at their zero.
//   - Links on the chain without a physical <inertial> get an estimate (link_inertia.hpp).
//   - Meshes get their file paths (package:// by --package and ROS_PACKAGE_PATH). Meshes that can't be drawn are left
//     out.
// Throws SetupError.
ArmSource read_arm(const NewCellOptions& options);

}  // namespace proxarm::command_line
