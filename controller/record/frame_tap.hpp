// Passes another network's traffic through unchanged, and copies every frame to a ring.
//
// The tap is for records on real interfaces, where nothing else sees all frames. A sent frame has the time of send(),
// or the time given to send_all(). The frame is on the wire later than this time, by its wait in the interface's queue
// and on the bus.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "models/base/spsc_ring.hpp"

namespace proxarm::controller {

struct TappedFrame {
  fieldbus::CanFrame frame;
  std::int64_t time_ns = 0;
  std::uint32_t bus = 0;
};

class FrameTap final : public fieldbus::CanNetwork {
 public:
  // Precondition: `network` outlives the tap.
  FrameTap(fieldbus::CanNetwork& network, std::size_t capacity);
  ~FrameTap() override;

  [[nodiscard]] SpscRing<TappedFrame>& frames() noexcept { return frames_; }

  [[nodiscard]] std::size_t bus_count() const noexcept override;
  [[nodiscard]] fieldbus::CanBus& bus(std::size_t index) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return network_.now_ns(); }
  void sleep_until(std::int64_t deadline_ns) noexcept override { network_.sleep_until(deadline_ns); }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override { return network_.wait_for_frame(deadline_ns); }
  [[nodiscard]] std::int64_t waited_ns() const noexcept override { return network_.waited_ns(); }
  [[nodiscard]] std::int64_t behind_ns() const noexcept override { return network_.behind_ns(); }

 private:
  class TappedBus;

  fieldbus::CanNetwork& network_;
  SpscRing<TappedFrame> frames_;
  std::vector<std::unique_ptr<TappedBus>> buses_;
};

}  // namespace proxarm::controller
