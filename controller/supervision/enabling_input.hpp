// Reads the person's enabling switch (dead man's switch) from a bit on a CAN bus: in a TPDO of a drive, or in a
// separate message.
//
// The switch counts as released while its state is unknown: before the first message, if the last message is older than
// the timeout, or if the message is too short to contain the bit. To start or continue, the person must press the
// switch anew: one message must report "released", and the next message, within the timeout, must report "pressed". A
// switch that is held, tied down or stuck at "pressed" never starts anything.
//
// A three-position switch has a second contact, which closes when the switch is squeezed through (IEC 60204-1, 10.9):
//
//   contacts (middle, panic)   position    state before           new state
//   0, 0                       released    any                    released
//   1, 0                       middle      released               pressed, anew
//   1, 0                       middle      pressed                pressed
//   1, 0                       middle      squeezed, or unknown   not pressed, until it was released
//   0, 1 and 1, 1              squeezed    any                    squeezed, not pressed
//   no message, or too old     unknown     any                    not pressed; if squeezed, still squeezed
// So a switch that returns from the third position through the middle position enables nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "fieldbus/can/can_frame.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class EnablingInput {
 public:
  // `bus`: the bus's index in the network. Precondition: the cell has the drive that `input` names.
  EnablingInput(const description::EnablingInputDescription& input, const description::Cell& cell, std::size_t bus);

  [[nodiscard]] std::size_t bus() const noexcept { return bus_; }
  // The message's identifier, with extended_id_flag if it has 29 bits, as in the lists of fieldbus::CanFilter.
  [[nodiscard]] std::uint32_t wanted_id() const noexcept;

  // Takes a received frame. Returns true if it is the switch's message. Precondition of this function and all functions
  // below: only the cycle's thread calls them.
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept;
  // Forgets the last message if it has become too old. Precondition: called in each cycle before the functions below.
  void on_cycle(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool pressed() const noexcept { return pressed_; }
  // Whether the switch was squeezed through and hasn't been released since; always false with two positions.
  [[nodiscard]] bool squeezed() const noexcept { return squeezed_; }
  // Returns true once per press after a release, while the switch is still pressed.
  [[nodiscard]] bool take_press() noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(last_ns_, heard_, pressed_, released_before_, pressed_anew_, squeezed_);
  }

 private:
  enum class Position : std::uint8_t { unknown, released, middle, squeezed };
  // A bit of the message's data, and the bit's value when the contact is closed.
  struct Contact {
    std::size_t byte = 0;
    std::uint8_t mask = 0;
    bool made_is = true;
  };

  [[nodiscard]] Position position_by(const fieldbus::CanFrame& frame) const noexcept;

  std::size_t bus_;
  std::uint32_t id_;
  bool extended_;
  Contact middle_;
  std::optional<Contact> panic_;  // contact of the third position
  std::int64_t timeout_ns_;
  std::int64_t last_ns_ = 0;
  bool heard_ = false, pressed_ = false, released_before_ = false, pressed_anew_ = false;
  bool squeezed_ = false;
};

}  // namespace proxarm::controller
