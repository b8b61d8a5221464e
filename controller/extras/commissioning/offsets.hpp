// Finds the zeros of a cell's encoders from the positions that the drives report in poses with known angles, and writes
// the zeros into the cell's file as offset_counts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// A pose to which a person has brought the arm: the joints' motor angles that follow from the marks, and the position
// that each drive reports (6064h).
struct MarkedPose {
  std::vector<double> angle_rad;
  std::vector<std::int32_t> counts;
};

// Returns the offset_counts with which the drive's position `counts` means `angle_rad`: counts − angle · counts per
// rad. Throws SetupError if the result doesn't fit 32 bits.
std::int32_t offset_by(const description::DriveDescription& drive, double angle_rad, std::int32_t counts);

// Returns the angle that follows from `counts` and `offset`, minus the marked angle `angle_rad`, in rad.
double off_by(const description::DriveDescription& drive, std::int32_t offset, double angle_rad, std::int32_t counts);

// Returns the cell's text with drives[i].offset_counts = offsets[i]; all other text stays, comments included. Throws
// SetupError if the text lacks a drive.
std::string with_offsets(const std::string& text, const description::Cell& cell,
                         const std::vector<std::int32_t>& offsets);

// Writes the text of with_offsets() into the cell's file. Returns the path of a backup beside the file. If the cell of
// the new text differs from `cell` in more than the offsets, throws and leaves the file unchanged. Throws SetupError.
std::filesystem::path write_offsets(const description::Cell& cell, const std::vector<std::int32_t>& offsets);

}  // namespace proxarm::command_line
