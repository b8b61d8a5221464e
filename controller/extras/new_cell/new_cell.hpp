// Runs `proxarm new-cell`, which writes a complete cell for an arm from the arm's URDF or xacro.
//
// What the URDF doesn't state is estimated by rules of thumb (drive_rules.hpp, link_inertia.hpp), and the estimates are
// marked in the files. The cell runs at once in simulation. For a real arm the user replaces the estimates by values
// from data sheets.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::command_line {

struct NewCellOptions {
  std::filesystem::path arm;                 // .urdf or .xacro
  std::vector<std::string> xacro_arguments;  // NAME:=VALUE
  std::vector<std::string> packages;         // NAME=DIR, for package:// and $(find NAME)
  std::filesystem::path out;                 // folder; empty: named after the robot
  std::string tip;                           // link that carries the sensor; empty: found
  std::string sensor = "ati_net_can_oem";    // name of a sensor in models/sensors, or a file
  std::filesystem::path eds;                 // EDS or DCF file of the drives; empty: none
  std::optional<int> buses;                  // number of buses; unset: the fewest for the shortest timestep
  std::optional<double> arm_mass_kg;  // mass of the arm, for links whose mass the file doesn't state; unset: estimated
  bool force = false;                 // overwrite a cell that exists
};

// Runs the command and returns the exit status. Throws SetupError.
int new_cell_command(const NewCellOptions& options);

}  // namespace proxarm::command_line
