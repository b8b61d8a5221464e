#include "fieldbus/cia402/cia402_state.hpp"

namespace proxarm::fieldbus {
namespace {

struct StateRow {
  std::uint16_t mask, value;
  DriveState state;
};

// CiA 402-2, statusword: a drive is in the row's state if statusword & mask equals the row's value.
constexpr StateRow state_rows[] = {
    {0x004F, 0x0000, DriveState::not_ready_to_switch_on}, {0x004F, 0x0040, DriveState::switch_on_disabled},
    {0x006F, 0x0021, DriveState::ready_to_switch_on},     {0x006F, 0x0023, DriveState::switched_on},
    {0x006F, 0x0027, DriveState::operation_enabled},      {0x006F, 0x0007, DriveState::quick_stop_active},
    {0x004F, 0x000F, DriveState::fault_reaction_active},  {0x004F, 0x0008, DriveState::fault},
};

struct TransitionRow {
  DriveGoal goal;
  DriveState from;
  ControlStep step;
};

namespace cw = controlword;

// For combinations of goal and state that aren't listed, the controlword is 00 (disable voltage).
constexpr TransitionRow transition_rows[] = {
    {DriveGoal::operation_enabled, DriveState::switch_on_disabled, {cw::shutdown, 2}},
    {DriveGoal::operation_enabled, DriveState::ready_to_switch_on, {cw::switch_on, 3}},
    {DriveGoal::operation_enabled, DriveState::switched_on, {cw::enable_operation, 4}},
    {DriveGoal::operation_enabled, DriveState::operation_enabled, {cw::enable_operation, -1}},
    // Leaves the quick stop by disabling voltage. Transition 16 would restart the motion, and the standard doesn't
    // recommend it either.
    {DriveGoal::operation_enabled, DriveState::quick_stop_active, {cw::disable_voltage, 12}},

    {DriveGoal::switched_off, DriveState::operation_enabled, {cw::shutdown, 8}},
    {DriveGoal::switched_off, DriveState::switched_on, {cw::shutdown, 6}},
    {DriveGoal::switched_off, DriveState::ready_to_switch_on, {cw::disable_voltage, 7}},
    // Until the ramp of the quick stop ends.
    {DriveGoal::switched_off, DriveState::quick_stop_active, {cw::quick_stop, -1}},

    {DriveGoal::quick_stop, DriveState::operation_enabled, {cw::quick_stop, 11}},
    {DriveGoal::quick_stop, DriveState::quick_stop_active, {cw::quick_stop, -1}},
    {DriveGoal::quick_stop, DriveState::switched_on, {cw::quick_stop, 10}},
    {DriveGoal::quick_stop, DriveState::ready_to_switch_on, {cw::quick_stop, 7}},
    {DriveGoal::quick_stop, DriveState::switch_on_disabled, {cw::disable_voltage, -1}},

    {DriveGoal::fault_reset, DriveState::fault, {cw::fault_reset, 15}},
    {DriveGoal::fault_reset, DriveState::operation_enabled, {cw::shutdown, 8}},
    {DriveGoal::fault_reset, DriveState::switched_on, {cw::shutdown, 6}},
    {DriveGoal::fault_reset, DriveState::ready_to_switch_on, {cw::disable_voltage, 7}},
    {DriveGoal::fault_reset, DriveState::quick_stop_active, {cw::quick_stop, -1}},
};

}  // namespace

DriveState decode_state(std::uint16_t statusword) noexcept {
  for (const StateRow& row : state_rows) {
    if ((statusword & row.mask) == row.value) return row.state;
  }
  return DriveState::unknown;
}

ControlStep next_controlword(DriveState state, DriveGoal goal, std::uint16_t previous_controlword) noexcept {
  for (const TransitionRow& row : transition_rows) {
    if (row.goal != goal || row.from != state) continue;
    // The rising edge of bit 7 resets the fault. So bit 7 must be sent as 0 once before it is sent as 1.
    if (row.step.transition == 15 && (previous_controlword & cw::fault_reset) != 0) return {cw::disable_voltage, -1};
    return row.step;
  }
  return {cw::disable_voltage, -1};
}

std::string_view to_string(DriveState state) noexcept {
  switch (state) {
    case DriveState::not_ready_to_switch_on:
      return "not ready to switch on";
    case DriveState::switch_on_disabled:
      return "switch on disabled";
    case DriveState::ready_to_switch_on:
      return "ready to switch on";
    case DriveState::switched_on:
      return "switched on";
    case DriveState::operation_enabled:
      return "operation enabled";
    case DriveState::quick_stop_active:
      return "quick stop active";
    case DriveState::fault_reaction_active:
      return "fault reaction active";
    case DriveState::fault:
      return "fault";
    case DriveState::unknown:
      break;
  }
  return "unknown state";
}

}  // namespace proxarm::fieldbus
