// Defines the interface of receivers of frames that aren't process data.
#pragma once

#include <cstddef>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::controller {

// Receives the frames that aren't process data of the sensor or a drive. on_frame() returns true if the frame was for
// this listener.
class FrameListener {
 public:
  FrameListener() = default;
  FrameListener(const FrameListener&) = delete;
  FrameListener& operator=(const FrameListener&) = delete;
  virtual ~FrameListener() = default;
  virtual bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept = 0;
};

}  // namespace proxarm::controller
