// What can be wrong with a simulated force sensor, of whatever make. All off: a good one.
#pragma once

#include <cstdint>

namespace proxarm::sim {

struct SensorFaults {
  bool silent = false;            // answers nothing
  bool silent_samples = false;    // everything but samples
  bool frozen = false;            // repeats the sample that was the last when the fault began
  bool half_sample = false;       // the last frame of each sample is missing
  bool swapped = false;           // the frames of each sample come in reverse order
  bool duplicated = false;        // each frame of a sample comes twice
  bool short_frames = false;      // each frame of a sample lacks its last byte
  bool bad_checksum = false;      // each sample's checksum is wrong; without one, nothing happens
  bool saturated = false;         // the first channel is at its upper end
  int stuck_channel = -1;         // this gauge or signal repeats its last value; −1: none
  std::uint32_t status_bits = 0;  // set in the status word, where there is one
  std::uint32_t lost_one_in = 0;  // every so many-th frame of samples is lost; 0: none
  std::int64_t delay_ns = 0;      // on top of the answer time
};

}  // namespace proxarm::sim
