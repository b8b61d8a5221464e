// Finds the zeros of a cell's encoders from the positions that drives report in poses with known angles, and writes
// them into the cell's file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// A pose to which a person has brought the arm: the motor angles at the joints, and each drive's reported position
// (6064h).
struct MarkedPose {
  std::vector<double> angle_rad;
  std::vector<std::int32_t> counts;
};

// Returns the offset_counts with which the first pose has its angles: counts − angle · counts per rad. Throws
// SetupError if that doesn't fit 32 bits.
std::int32_t offset_by(const description::DriveDescription& drive, double angle_rad, std::int32_t counts);

// Returns the angle computed with `offset` minus the mark in this pose, rad.
double off_by(const description::DriveDescription& drive, std::int32_t offset, double angle_rad, std::int32_t counts);

// Returns the cell's text with drives[i].offset_counts = offsets[i]; everything else, comments too, stays. Throws
// SetupError if the text lacks a drive.
std::string with_offsets(const std::string& text, const description::Cell& cell,
                         const std::vector<std::int32_t>& offsets);

// Writes that text to the cell's file and returns the path of a backup beside it. If the new text differs from the cell
// in more than the offsets, the file is unchanged. Throws SetupError.
std::filesystem::path write_offsets(const description::Cell& cell, const std::vector<std::int32_t>& offsets);

}  // namespace proxarm::command_line
