// Reads and writes the zero of a cell's force sensor, which is the file CELL.zero beside the cell. The zero is the
// sensor's reading minus the tool's weight with nobody at the handle; the file also has the date and the pose. A
// session compares its tare with the zero.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

struct ZeroFile {
  std::string cell_sha256;  // hash as in a proof: of the cell's file, its URDF and its sensor's file
  bool real_arm = false;    // false: a simulated arm
  std::string date;         // UTC
  std::array<double, 3> force_S_N{}, torque_S_Nm{};
  // Noise of one sample, and largest difference of a sample from the mean.
  double noise_N = 0.0, spread_N = 0.0;
  std::vector<double> motor_rad;  // angles of the motors during the tare
};

std::filesystem::path zero_path(const description::Cell& cell);

// Throws SetupError if the file can't be written.
void write_zero(const std::filesystem::path& file, const ZeroFile& zero);

// Returns the kept zero if it is of this cell and of this kind of arm, real or simulated; otherwise nullopt. Throws
// SetupError if the file isn't a zero file.
std::optional<ZeroFile> kept_zero(const PreparedSession& session, bool real_arm);

}  // namespace proxarm::controller
