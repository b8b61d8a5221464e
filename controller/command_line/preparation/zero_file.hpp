// The zero of a cell's force sensor as a file beside the cell, CELL.zero: what it reads beyond the tool's weight with
// nobody at the handle, and when and where that was found. A session's tare is held against it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct ZeroFile {
  std::string cell_sha256;  // as of a proof: of the cell's file, its URDF and its sensor's
  bool real_arm = false;    // else a simulated one
  std::string date;         // UTC
  std::array<double, 3> force_S_N{}, torque_S_Nm{};
  double noise_N = 0.0, spread_N = 0.0;  // of a sample, and the furthest of them from the mean
  std::vector<double> motor_rad;         // the pose
};

std::filesystem::path zero_path(const description::Cell& cell);

// Throws SetupError where it can't be written.
void write_zero(const std::filesystem::path& file, const ZeroFile& zero);

// The zero of this cell on this kind of arm. nullopt: none is kept, or it is that of another cell. Throws SetupError
// for a file that is none.
std::optional<ZeroFile> kept_zero(const PreparedSession& session, bool real_arm);

}  // namespace proxarm::command_line
