// The zeros of a cell's encoders: from positions that drives report in poses whose angles are known, into the cell's
// file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Where somebody has brought the arm to, as angles of the motors at the joints, and what each drive then reports
// (6064h).
struct MarkedPose {
  std::vector<double> angle_rad;
  std::vector<std::int32_t> counts;
};

// offset_counts so that the first pose has its angles: counts − angle · counts per rad. Throws SetupError where that
// doesn't fit 32 bits.
std::int32_t offset_by(const description::DriveDescription& drive, double angle_rad, std::int32_t counts);

// How far the angle by `offset` is from the marks in this pose, rad.
double off_by(const description::DriveDescription& drive, std::int32_t offset, double angle_rad, std::int32_t counts);

// The cell's text with drives[i].offset_counts = offsets[i]; everything else, comments too, stays as it is. Throws
// SetupError where a drive isn't found in the text.
std::string with_offsets(const std::string& text, const description::Cell& cell,
                         const std::vector<std::int32_t>& offsets);

// Writes that to the cell's file, and keeps what was there in a backup beside it, whose path is returned. The new text
// must be the same cell but for the offsets; else nothing is changed. Throws SetupError.
std::filesystem::path write_offsets(const description::Cell& cell, const std::vector<std::int32_t>& offsets);

}  // namespace proxarm::command_line
