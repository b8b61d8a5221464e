// The person's enabling switch (dead man) as a bit that comes on a CAN bus, in a TPDO of a drive or a message of its
// own.
//
// Released is what can't be known: no message yet, a message older than the timeout, one too short to hold the bit.
// Whoever starts or goes on must press it anew: a message that says released, then one that says pressed, without a gap
// beyond the timeout between any two. One that is held, tied down or stuck at "pressed" never starts anything.
#pragma once

#include <cstddef>
#include <cstdint>

#include "fieldbus/can_frame.hpp"
#include "fieldbus/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class EnablingInput {
 public:
  // `bus`: index in the network. The cell has the drive that is named.
  EnablingInput(const description::EnablingInputDescription& input, const description::Cell& cell, std::size_t bus);

  [[nodiscard]] std::size_t bus() const noexcept { return bus_; }
  // As fieldbus::CanFilter's lists have it: with extended_id_flag where it is one of 29 bits.
  [[nodiscard]] std::uint32_t wanted_id() const noexcept;

  // True where the frame was the message. All of it is the cycle's.
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept;
  // Before anything asks: what is too old by now is forgotten.
  void on_cycle(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return pressed_; }
  // Pressed anew since the last call.
  [[nodiscard]] bool take_press() noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(last_ns_, heard_, pressed_, released_before_, pressed_anew_);
  }

 private:
  std::size_t bus_;
  std::uint32_t id_;
  bool extended_;
  std::size_t byte_;
  std::uint8_t mask_;
  bool pressed_is_;
  std::int64_t timeout_ns_;
  std::int64_t last_ns_ = 0;
  bool heard_ = false, pressed_ = false, released_before_ = false, pressed_anew_ = false;
};

}  // namespace proxarm::controller
