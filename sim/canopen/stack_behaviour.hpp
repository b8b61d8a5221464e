// How a simulated drive's CANopen stack behaves where the standard leaves it open, or where stacks differ from it.
//
//   strict    as CiA 301 and CiA 402-2 have it: an RPDO's event timer (1400h:05) runs by itself; SYNC is watched
//             (3 periods); an error goes when its cause goes; 6007h says what a lost connection does.
//   latching  what is lost is a fault that stays: a lost heartbeat, an overdue RPDO and a missing SYNC trip the drive
//             whether it is enabled or not, and the error stays until a fault reset (controlword, bit 7). So
//             Kollmorgen's S300/S700 have errors that only bit 7 of the controlword clears (CANopen manual, emergency
//             messages, category 2), and CANopenNode keeps an RPDO's timeout when RPDOs come again (its issue 612) and
//             kept one of SYNC (its pull request 220).
//   lazy      an RPDO's timer is looked at when a SYNC has come, for synchronous RPDOs: CANopenNode's CO_RPDO_process()
//             (301/CO_PDO.c) looks at such an RPDO only where a SYNC came. A dead controller sends none, so the
//             heartbeat consumer alone stops the drive. A missing SYNC is told (EMCY 8100h, after 1.5 times 1006h, in
//             pre-operational as well, as CO_SYNC_process() does) and stops nothing.
//   holding   lazy, and NMT start is refused while an error of the connection (8100h, 8130h) stands; SYNC and the
//             heartbeat clear it in pre-operational, too. CANopenNode's newer versions (its pull request 220); SYNC is
//             watched on from the session before.
//   insisting the same, but the error stands until the communication or the node is reset: its older versions.
#pragma once

#include <cstdint>

namespace proxarm::sim {

enum class StackBehaviour : std::uint8_t { strict, latching, lazy, holding, insisting };

[[nodiscard]] constexpr bool holds_nmt_start(StackBehaviour stack) noexcept {
  return stack == StackBehaviour::holding || stack == StackBehaviour::insisting;
}
// Looks at RPDO timers as a lazy one does.
[[nodiscard]] constexpr bool is_lazy(StackBehaviour stack) noexcept {
  return stack == StackBehaviour::lazy || holds_nmt_start(stack);
}

}  // namespace proxarm::sim
