// What a frame on a cell's bus says: whose it is, which objects it carries, and their values with units.
#pragma once

#include <cstdint>
#include <string>

#include "controller/record/replay_log.hpp"
#include "models/description/cell.hpp"

namespace proxarm::view {

struct FrameWords {
  std::string bus;    // as the network calls it
  std::string id;     // hexadecimal
  std::string bytes;  // the same, a space between two
  std::string from;   // "axis_3", "sensor", "controller"
  std::string words;  // "target position 607Ah: 1234 = 0.0123 rad"
};

// `head` says which bus of the network is which of the cell's.
FrameWords describe_frame(const controller::BoxFrame& frame, const controller::ReplayHead& head,
                          const description::Cell& cell);

}  // namespace proxarm::view
