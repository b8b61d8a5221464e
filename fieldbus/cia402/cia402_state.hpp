// The power state machine of a CiA 402 drive. decode_state() gets the state from the statusword (6041h).
// next_controlword() returns the controlword (6040h) for the next transition towards a goal. In the diagram, each arrow
// shows the transition's number and its controlword:
//
//            0,1                 2: 06          3: 07            4: 0F
//   start ───────▶ switch on ──────────▶ ready to ────────▶ switched ────────▶ operation ──11: 02──▶ quick stop
//                  disabled  ◀────────── switch on ◀──────── on      ◀──────── enabled               active
//                      ▲       7: 00/02            6: 06             5: 07        │ 8: 06, 9: 00        │ 12: 00
//                      └──────────────────────────────────────────────────────────┴────────────────────┘
//   any state ──13──▶ fault reaction active ──14──▶ fault ──15: rising edge of bit 7──▶ switch on disabled
#pragma once

#include <cstdint>
#include <string_view>

namespace proxarm::fieldbus {

enum class DriveState : std::uint8_t {
  not_ready_to_switch_on,  // self-test; the drive leaves this state by itself
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,  // the drive is stopping
  fault,
  unknown,  // the statusword isn't in the standard's table
};

enum class DriveGoal : std::uint8_t {
  none,               // sends controlword 00 in any state
  operation_enabled,  // switches on and enables operation; doesn't reset faults
  switched_off,       // goes to switch on disabled, after the drive's deceleration (605Bh)
  quick_stop,         // stops on the quick-stop ramp (605Ah), then goes to switch on disabled
  fault_reset,        // leaves the state fault; in other states like switched_off
};

namespace controlword {
inline constexpr std::uint16_t disable_voltage = 0x0000;
inline constexpr std::uint16_t quick_stop = 0x0002;
inline constexpr std::uint16_t shutdown = 0x0006;
inline constexpr std::uint16_t switch_on = 0x0007;
inline constexpr std::uint16_t enable_operation = 0x000F;
inline constexpr std::uint16_t fault_reset = 0x0080;  // acts on the rising edge
}  // namespace controlword

namespace statusword {
inline constexpr std::uint16_t fault = 1U << 3;
inline constexpr std::uint16_t voltage_enabled = 1U << 4;
inline constexpr std::uint16_t warning = 1U << 7;
inline constexpr std::uint16_t remote = 1U << 9;  // 0: the drive ignores the controlword
inline constexpr std::uint16_t internal_limit_active = 1U << 11;
inline constexpr std::uint16_t follows_command = 1U << 12;  // 1, in cyclic modes: the drive follows targets
inline constexpr std::uint16_t following_error = 1U << 13;  // in cyclic modes
}  // namespace statusword

struct ControlStep {
  std::uint16_t controlword = 0;
  int transition = -1;  // number of the requested transition in the standard; −1: keep the state
};

[[nodiscard]] DriveState decode_state(std::uint16_t statusword) noexcept;
// Returns the next step from `state` towards `goal`. `previous_controlword` is the controlword sent last; it is needed
// because a fault is reset by a rising edge.
[[nodiscard]] ControlStep next_controlword(DriveState state, DriveGoal goal,
                                           std::uint16_t previous_controlword) noexcept;
[[nodiscard]] std::string_view to_string(DriveState state) noexcept;

}  // namespace proxarm::fieldbus
