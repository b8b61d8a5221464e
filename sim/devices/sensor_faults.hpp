// Faults of a simulated force sensor of any make. The default is no fault.
#pragma once

#include <cstdint>

namespace proxarm::sim {

struct SensorFaults {
  bool silent = false;            // the sensor answers no request
  bool silent_samples = false;    // the sensor answers all requests except polls
  bool frozen = false;            // the sensor repeats the last sample before the fault
  bool half_sample = false;       // the last frame of each sample is missing
  bool swapped = false;           // the frames of each sample come in reverse order
  bool duplicated = false;        // each frame of a sample comes twice
  bool short_frames = false;      // each frame of a sample lacks its last byte
  bool bad_checksum = false;      // the checksum is wrong; no effect on sensors without a checksum
  bool saturated = false;         // the first channel is at the upper end of its range
  int stuck_channel = -1;         // this gauge or signal repeats its last value; −1: no channel does
  std::uint32_t status_bits = 0;  // bits that are set in the status word, if the sensor has one
  std::uint32_t lost_one_in = 0;  // one of this many sample frames is lost; 0: no frame is lost
  std::int64_t delay_ns = 0;      // delay in addition to the answer time
};

}  // namespace proxarm::sim
