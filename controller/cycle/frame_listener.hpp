// Interface for receivers of frames other than process data.
#pragma once

#include <cstddef>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::controller {

// Takes frames that are neither the sensor's nor a drive's process data. Returns true if the frame was for this
// listener.
class FrameListener {
 public:
  FrameListener() = default;
  FrameListener(const FrameListener&) = delete;
  FrameListener& operator=(const FrameListener&) = delete;
  virtual ~FrameListener() = default;
  virtual bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept = 0;
};

}  // namespace proxarm::controller
