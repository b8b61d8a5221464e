// Converts a maker's URDF or xacro to the chain of one to seven joints that proxarm moves.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/new_cell/new_cell.hpp"

namespace proxarm::command_line {

struct ChainJoint {
  std::string name;
  bool slides = false;
  std::array<double, 2> range{};  // rad or m; the URDF's limits less a small margin
  double max_speed = 0.0;         // 0: not stated
  double max_effort = 0.0;        // Nm or N; 0: not stated
};

struct ArmSource {
  std::string name;                  // the robot's name
  std::string tip;                   // the link that carries the sensor
  std::vector<ChainJoint> joints;    // the chain's joints, outwards from the base
  std::string urdf;                  // text of the URDF beside the cell, in which only the chain's joints move
  std::vector<std::string> remarks;  // changes of the URDF and estimates, one line each
};

// Reads the URDF, or expands the xacro by the program xacro, and makes a URDF from which an arm can be built:
//   - The chain goes from the root to --tip. Without --tip it goes to where the moving joints end or branch (into a
//     gripper's fingers), and on to a link that is fixed there and has a usual name, such as tool0 or flange, if there
//     is one.
//   - Joints beside the chain, mimic joints included, are fixed at their zero.
//   - Links on the chain without a physical <inertial> get an estimate (link_inertia.hpp).
//   - Names of meshes are replaced by file paths (package:// by --package and ROS_PACKAGE_PATH). Meshes that can't be
//     drawn are left out.
// Throws SetupError.
ArmSource read_arm(const NewCellOptions& options);

}  // namespace proxarm::command_line
