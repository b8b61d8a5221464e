// `proxarm new-cell`: writes a complete cell for an arm from its URDF or xacro.
//
// What the URDF doesn't say is estimated by rules of thumb (drive_rules.hpp, link_inertia.hpp) and marked so in the
// files. The cell runs at once in simulation; the user replaces the estimates by figures from data sheets.
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
  std::string sensor = "ati_net_can_oem";    // name in models/sensors, or a file
  std::filesystem::path eds;                 // of the drives; empty: none
  std::optional<int> buses;                  // unset: as many as 1 ms needs
  std::optional<double> arm_mass_kg;         // of links without a mass in the file; unset: by the arm's reach
  bool force = false;                        // overwrite an earlier cell
};

// Returns the exit status. Throws SetupError.
int new_cell_command(const NewCellOptions& options);

}  // namespace proxarm::command_line
