// The simulated person's enabling switch: the times at which it is pressed, and its message if it sends one.
//
// Times count from the first SYNC on the cell's buses, or from power on if no drive is on CAN. A second without SYNC
// ends a session; in the next session the times begin again. Before the first span the switch is released.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "models/description/supervision.hpp"
#include "sim/bus/device_port.hpp"

namespace proxarm::sim {

// A time span in which the switch is pressed. A switch with three positions is then in its middle position, or in its
// third position if `squeezed`.
struct PressedSpan {
  std::int64_t from_ns = 0;
  std::int64_t until_ns = INT64_MAX;
  bool squeezed = false;
};

// Parses "0.5s..3s", "2s.." or "squeezed:2s..3s". Throws SetupError that names the option.
[[nodiscard]] PressedSpan parse_pressed_span(std::string_view text);

class EnablingSwitch final : public BusDevice {
 public:
  // `port` carries the switch's message; nullptr: the switch is wired to a drive. If each of the `spans` is squeezed,
  // or if there is no span, the switch is also pressed from 0.1 s on.
  EnablingSwitch(const description::EnablingInputDescription& input, std::vector<PressedSpan> spans, DevicePort* port);

  void on_sync(std::int64_t time_ns) noexcept;
  // Starts the times in a cell without SYNC.
  void begin_without_sync(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return pressed_; }
  [[nodiscard]] bool squeezed() const noexcept { return squeezed_; }
  // Returns the switch's bits in the drive's object; other bits are 0.
  [[nodiscard]] std::uint32_t digital_inputs() const noexcept;

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t time_ns) noexcept override;

 private:
  void send(std::int64_t time_ns) noexcept;
  // Returns the state of each contact at the contact's bit. Bits count from bit 0 of byte 0 of the message or object.
  [[nodiscard]] std::uint64_t contacts() const noexcept;

  description::EnablingInputDescription input_;
  std::vector<PressedSpan> spans_;
  DevicePort* port_;
  std::int64_t begin_ns_ = 0, last_sync_ns_ = 0, next_ns_ = 0;
  bool begun_ = false, endless_ = false;
  bool pressed_ = false, squeezed_ = false;
};

}  // namespace proxarm::sim
