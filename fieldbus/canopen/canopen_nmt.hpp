// NMT (CiA 301, 7.2.8.3.1): the commands by which the master changes a node's state to pre-operational, operational or
// stopped.
//
// Wire: identifier 000, two bytes: the command and the node number (0: all nodes of the bus).
#pragma once

#include <cstdint>
#include <string_view>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint8_t all_nodes = 0;

enum class NmtCommand : std::uint8_t {
  start = 0x01,                  // → operational: PDOs are sent and received
  stop = 0x02,                   // → stopped: only NMT commands and heartbeats work
  enter_pre_operational = 0x80,  // → pre-operational: SDOs work, PDOs don't
  reset_node = 0x81,             // resets the whole device, as switching it on does
  reset_communication = 0x82,    // resets only the objects of the communication profile
};

// NMT states as heartbeats and boot-up messages encode them (7.2.8.3.2).
enum class NmtState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F,
  unknown = 0xFF,  // no heartbeat was received yet, or its value isn't defined in the standard
};

// Precondition: `node` is 0..127.
[[nodiscard]] CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept;
// Ignores bit 7, which is the toggle bit of node guarding.
[[nodiscard]] NmtState nmt_state_from_byte(std::uint8_t byte) noexcept;
[[nodiscard]] std::string_view to_string(NmtState state) noexcept;

}  // namespace proxarm::fieldbus
