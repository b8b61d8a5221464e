// The simulated person's enabling switch: the times at which it is pressed, and its message if it has one.
//
// Times count from the first SYNC on the cell's buses (from power on if no drive is on CAN). A second without SYNC ends
// a session; the next one starts the times again. Before the first span the switch is released.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "models/description/supervision.hpp"
#include "sim/bus/device_port.hpp"

namespace proxarm::sim {

// During a span, a switch with two positions is pressed; one with three is in its middle position, or squeezed.
struct PressedSpan {
  std::int64_t from_ns = 0;
  std::int64_t until_ns = INT64_MAX;
  bool squeezed = false;
};

// "0.5s..3s", "2s.." or "2s"; "squeezed:2s..3s". Throws SetupError that names the option.
[[nodiscard]] PressedSpan parse_pressed_span(std::string_view text);

class EnablingSwitch final : public BusDevice {
 public:
  // `port` carries its message; null: wired to a drive. Without spans, pressed from 0.1 s on.
  EnablingSwitch(const description::EnablingInputDescription& input, std::vector<PressedSpan> spans, DevicePort* port);

  void on_sync(std::int64_t time_ns) noexcept;
  // For cells without SYNC.
  void begin_without_sync(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return pressed_; }
  [[nodiscard]] bool squeezed() const noexcept { return squeezed_; }
  // Its bits in the drive's object; other bits are 0.
  [[nodiscard]] std::uint32_t digital_inputs() const noexcept;

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t time_ns) noexcept override;

 private:
  void send(std::int64_t time_ns) noexcept;
  // Each contact at its bit, counted from bit 0 of byte 0 of the message or object.
  [[nodiscard]] std::uint64_t contacts() const noexcept;

  description::EnablingInputDescription input_;
  std::vector<PressedSpan> spans_;
  DevicePort* port_;
  std::int64_t begin_ns_ = 0, last_sync_ns_ = 0, next_ns_ = 0;
  bool begun_ = false, endless_ = false;
  bool pressed_ = false, squeezed_ = false;
};

}  // namespace proxarm::sim
