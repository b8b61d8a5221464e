// Reads and writes the zero of a cell's force sensor, the file CELL.zero beside the cell. It holds what the sensor
// reads beyond the tool's weight with nobody at the handle, with date and pose. A session's tare is compared with it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct ZeroFile {
  std::string cell_sha256;  // hash as in a proof: of the cell's file, its URDF and its sensor's file
  bool real_arm = false;    // false: a simulated arm
  std::string date;         // UTC
  std::array<double, 3> force_S_N{}, torque_S_Nm{};
  double noise_N = 0.0, spread_N = 0.0;  // noise of one sample; largest distance of a sample from the mean
  std::vector<double> motor_rad;         // the pose
};

std::filesystem::path zero_path(const description::Cell& cell);

// Throws SetupError if the file can't be written.
void write_zero(const std::filesystem::path& file, const ZeroFile& zero);

// Returns the zero of this cell on this kind of arm; nullopt if there is none or it belongs to another cell. Throws
// SetupError if the file isn't a zero file.
std::optional<ZeroFile> kept_zero(const PreparedSession& session, bool real_arm);

}  // namespace proxarm::command_line
