// Describes a frame on a bus of the cell: the frame's sender, the objects in it, and the objects' values with units.
#pragma once

#include <cstdint>
#include <string>

#include "controller/record/replay_log.hpp"
#include "models/description/cell.hpp"

namespace proxarm::view {

struct FrameWords {
  std::string bus;
  std::string id;     // hexadecimal
  std::string bytes;  // hexadecimal, separated by spaces
  std::string from;   // "axis_3", "sensor", "controller"
  std::string words;  // "target position 607Ah: 1234 = 0.0123 rad"
};

// `head` says which of the cell's buses each of the network's buses is.
FrameWords describe_frame(const controller::BoxFrame& frame, const controller::ReplayHead& head,
                          const description::Cell& cell);

}  // namespace proxarm::view
