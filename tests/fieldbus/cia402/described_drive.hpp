// A CiA 402 drive in position mode on the bus "one", for conversation tests.
#pragma once

#include <cstdint>
#include <string>

#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

inline description::DriveDescription drive_of(std::uint8_t node) {
  description::DriveDescription drive;
  drive.joint = "axis_" + std::to_string(node);
  drive.bus = "one";
  drive.node = node;
  drive.profile = "cia402";
  drive.mode = "csp";
  drive.counts_per_motor_revolution = 4096.0;
  drive.gear_ratio = 100.0;
  drive.direction = 1;
  drive.range_rad = {-3.0, 3.0};
  drive.max_speed_rad_per_s = 1.0;
  drive.max_acceleration_rad_per_s2 = 10.0;
  return drive;
}

}  // namespace proxarm::fieldbus
