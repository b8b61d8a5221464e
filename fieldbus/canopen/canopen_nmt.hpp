// NMT (CiA 301, 7.2.8.3.1): the master's commands that move nodes between pre-operational, operational and stopped.
//
// Wire: identifier 000, two bytes: command, node (0: all nodes of the bus).
#pragma once

#include <cstdint>
#include <string_view>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint8_t all_nodes = 0;

enum class NmtCommand : std::uint8_t {
  start = 0x01,                  // → operational: PDOs run
  stop = 0x02,                   // → stopped: only NMT and heartbeat
  enter_pre_operational = 0x80,  // → pre-operational: SDO, no PDO
  reset_node = 0x81,             // whole device, as after power-on
  reset_communication = 0x82,    // communication profile area only
};

// NMT states in heartbeat and boot-up messages (7.2.8.3.2).
enum class NmtState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F,
  unknown = 0xFF,  // nothing received yet, or a value that the standard doesn't define
};

// `node` 0..127.
[[nodiscard]] CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept;
[[nodiscard]] NmtState nmt_state_from_byte(std::uint8_t byte) noexcept;  // bit 7 (node guarding's toggle) is ignored
[[nodiscard]] std::string_view to_string(NmtState state) noexcept;

}  // namespace proxarm::fieldbus
