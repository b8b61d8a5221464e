#include "sim/devices/drive_state_machine.hpp"

namespace proxarm::sim {

namespace {

struct Row {
  int number;
  DriveState from;
  DriveCommand command;
  DriveState to;
};

using enum DriveState;
using enum DriveCommand;

constexpr Row transitions[] = {
    {2, switch_on_disabled, shutdown, ready_to_switch_on},
    {3, ready_to_switch_on, switch_on, DriveState::switched_on},
    {3, ready_to_switch_on, enable_operation, DriveState::switched_on},  // transition 4 follows
    {4, DriveState::switched_on, enable_operation, operation_enabled},
    {5, operation_enabled, switch_on, DriveState::switched_on},
    {6, DriveState::switched_on, shutdown, ready_to_switch_on},
    {7, ready_to_switch_on, disable_voltage, switch_on_disabled},
    {7, ready_to_switch_on, quick_stop, switch_on_disabled},
    {8, operation_enabled, shutdown, ready_to_switch_on},
    {9, operation_enabled, disable_voltage, switch_on_disabled},
    {10, DriveState::switched_on, disable_voltage, switch_on_disabled},
    {10, DriveState::switched_on, quick_stop, switch_on_disabled},
    {11, operation_enabled, quick_stop, quick_stop_active},
    {12, quick_stop_active, disable_voltage, switch_on_disabled},
    {15, fault, fault_reset, switch_on_disabled},
    {16, quick_stop_active, enable_operation, operation_enabled},
};

}  // namespace

DriveCommand decode_controlword(std::uint16_t word, std::uint16_t word_before) noexcept {
  if ((word & 0x80) != 0) return (word_before & 0x80) == 0 ? fault_reset : none;
  if ((word & 0x02) == 0) return disable_voltage;
  if ((word & 0x04) == 0) return quick_stop;
  if ((word & 0x01) == 0) return shutdown;
  return (word & 0x08) != 0 ? enable_operation : switch_on;
}

DriveTransition transition_for(DriveState from, DriveCommand command) noexcept {
  for (const Row& row : transitions) {
    if (row.from == from && row.command == command) return {row.number, row.to};
  }
  return {0, from};
}

std::uint16_t statusword_bits(DriveState state) noexcept {
  switch (state) {
    case not_ready_to_switch_on:
      return 0x00;
    case switch_on_disabled:
      return 0x40;
    case ready_to_switch_on:
      return 0x21;
    case DriveState::switched_on:
      return 0x23;
    case operation_enabled:
      return 0x27;
    case quick_stop_active:
      return 0x07;
    case fault_reaction_active:
      return 0x0F;
    case fault:
      return 0x08;
  }
  return 0x00;
}

}  // namespace proxarm::sim
