// Behaviours of a simulated drive's CANopen stack that the standard leaves open, or in which stacks deviate from it.
//
// - strict: as in CiA 301 and CiA 402-2. The event timer of an RPDO (1400h:05) always runs. SYNC is watched (3
//   periods). An error ends when its cause ends. 6007h selects the reaction to a lost connection.
// - latching: a lost heartbeat, an overdue RPDO or a missing SYNC trips the drive, whether it is enabled or not. The
//   error stays until a fault reset (controlword, bit 7). Examples: Kollmorgen's S300/S700 have errors that only this
//   bit clears (CANopen manual, emergency messages, category 2); CANopenNode keeps the timeout of an RPDO when RPDOs
//   return (its issue 612), and kept a SYNC timeout (its pull request 220).
// - lazy: the timer of a synchronous RPDO is only checked when a SYNC has come, as in CANopenNode's CO_RPDO_process()
//   (301/CO_PDO.c). A dead controller sends no SYNC, so only the heartbeat consumer stops the drive. A missing SYNC is
//   reported (EMCY 8100h) after 1.5 times 1006h, also in pre-operational, as CO_SYNC_process() does. The missing SYNC
//   doesn't stop the drive.
// - holding: like lazy, but the drive refuses NMT start while a communication error (8100h, 8130h) persists. SYNC and
//   heartbeat clear the error, also in pre-operational. SYNC is still watched from the previous session on. Example:
//   newer versions of CANopenNode (its pull request 220).
// - insisting: like holding, but the error persists until the communication or the node is reset. Example: older
//   versions of CANopenNode.
#pragma once

#include <cstdint>

namespace proxarm::sim {

enum class StackBehaviour : std::uint8_t { strict, latching, lazy, holding, insisting };

// True if a drive with this stack refuses NMT start while a communication error persists.
[[nodiscard]] constexpr bool holds_nmt_start(StackBehaviour stack) noexcept {
  return stack == StackBehaviour::holding || stack == StackBehaviour::insisting;
}
// True if this stack checks RPDO timers like a lazy stack.
[[nodiscard]] constexpr bool is_lazy(StackBehaviour stack) noexcept {
  return stack == StackBehaviour::lazy || holds_nmt_start(stack);
}

}  // namespace proxarm::sim
