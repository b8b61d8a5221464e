// The person's enabling switch in a simulation: when it is pressed, and its message where it has one of its own.
//
// Times count from the first SYNC on the cell's buses (from power on where no drive is on CAN); a second without SYNC
// ends a session, and the next one begins them anew. Until it is pressed the first time it is let go.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "models/description/supervision.hpp"
#include "sim/bus/device_port.hpp"

namespace proxarm::sim {

// A switch with two positions is pressed meanwhile; one with three is in its middle position, or squeezed through.
struct PressedSpan {
  std::int64_t from_ns = 0;
  std::int64_t until_ns = INT64_MAX;
  bool squeezed = false;
};

// "0.5s..3s", "2s.." or "2s"; "squeezed:2s..3s". Throws SetupError that names the option.
[[nodiscard]] PressedSpan parse_pressed_span(std::string_view text);

class EnablingSwitch final : public BusDevice {
 public:
  // `port` carries its message; null: it is wired to a drive. No span: pressed from 0.1 s on.
  EnablingSwitch(const description::EnablingInputDescription& input, std::vector<PressedSpan> spans, DevicePort* port);

  void on_sync(std::int64_t time_ns) noexcept;
  // Where no SYNC will ever come.
  void begin_without_sync(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return pressed_; }
  [[nodiscard]] bool squeezed() const noexcept { return squeezed_; }
  // What it makes of the drive's object; bits that aren't its own are zero.
  [[nodiscard]] std::uint32_t digital_inputs() const noexcept;

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t time_ns) noexcept override;

 private:
  void send(std::int64_t time_ns) noexcept;
  // Each contact with its bit, counted from bit 0 of byte 0 of the message, or of the object.
  [[nodiscard]] std::uint64_t contacts() const noexcept;

  description::EnablingInputDescription input_;
  std::vector<PressedSpan> spans_;
  DevicePort* port_;
  std::int64_t begin_ns_ = 0, last_sync_ns_ = 0, next_ns_ = 0;
  bool begun_ = false, endless_ = false;
  bool pressed_ = false, squeezed_ = false;
};

}  // namespace proxarm::sim
