// The power state machine of a CiA 402 drive as a table: states, commands and the transition numbers of the standard. A
// drive is in a state if statusword & mask equals the state's value. A controlword is decoded by bits 7, 3, 2, 1 and 0
// (x: any value):
//
//   statusword               mask  value          controlword, bits 7 3 2 1 0
//   not ready to switch on   004F  0000          shutdown            0 x 1 1 0
//   switch on disabled       004F  0040          switch on           0 0 1 1 1   (= disable operation)
//   ready to switch on       006F  0021          enable operation    0 1 1 1 1
//   switched on              006F  0023          disable voltage     0 x x 0 x
//   operation enabled        006F  0027          quick stop          0 x 0 1 x
//   quick stop active        006F  0007          fault reset         rising edge of bit 7
//   fault reaction active    004F  000F
//   fault                    004F  0008
#pragma once

#include <cstdint>

namespace proxarm::sim {

enum class DriveState : std::uint8_t {
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};

enum class DriveCommand : std::uint8_t {
  none,
  shutdown,
  switch_on,
  enable_operation,
  disable_voltage,
  quick_stop,
  fault_reset,
};

struct DriveTransition {
  int number = 0;  // number in CiA 402; 0: the command has no effect in this state
  DriveState to = DriveState::not_ready_to_switch_on;
};

[[nodiscard]] DriveCommand decode_controlword(std::uint16_t word, std::uint16_t word_before) noexcept;
// Returns the transition that the command causes: 2 to 12, 15 or 16. The transitions 0, 1, 13, 14, and 12 after a quick
// stop, come without a command.
[[nodiscard]] DriveTransition transition_for(DriveState from, DriveCommand command) noexcept;
// Returns the bits 0..3, 5 and 6 of the statusword.
[[nodiscard]] std::uint16_t statusword_bits(DriveState state) noexcept;

}  // namespace proxarm::sim
