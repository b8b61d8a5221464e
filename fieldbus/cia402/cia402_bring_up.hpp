// From silent drives to a running process image: all drives of a cell are configured side by side, or none is started.
//
//   std::vector<ServoDrive> drives;  ...
//   bring_up_drives(network, slots);      // NMT pre-operational, identity, SDO written and read back, NMT start
//   ... the cycle: SYNC, heartbeat, PDOs; the power state machine runs in it ...
//   leave_operational(network, slots);    // after the last words (cia402_goodbye.hpp)
//
// Blocks until done, at most a few seconds; throws SetupError that names bus, node, object, what was found and
// expected. Nothing is enabled here: that takes controlwords, which only the cycle sends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "fieldbus/can/frame_pump.hpp"
#include "fieldbus/canopen/canopen_nmt.hpp"
#include "fieldbus/cia402/cia402_drive.hpp"

namespace proxarm::fieldbus {

struct DriveSlot {
  ServoDrive* drive = nullptr;
  std::size_t bus = 0;  // index in the network
};

// What was learned of a drive; for the log.
struct DriveIdentity {
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;  // 0 where the drive doesn't say, as the next three
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint32_t supported_modes = 0;
  std::vector<std::string> missing;  // optional objects it hasn't: "1006h:00 communication cycle period"
};

[[nodiscard]] std::string describe(const DriveIdentity& identity);

// What the drives lack, a line each: "drives of axis_1, axis_2: no 6007h:00: …".
[[nodiscard]] std::vector<std::string> losses_of(std::span<const DriveSlot> drives);

// Gets what was done besides the usual, a line each: "drive of axis_1 (bus can, node 1): started after …".
using Tell = std::function<void(const std::string&)>;

// Frames that aren't the drives' go to `other`. Two drives with one node on one bus are refused (one interface may
// carry several of the cell's buses). The drives' start_cycle() is called at the end.
std::vector<DriveIdentity> bring_up_drives(CanNetwork& network, std::span<const DriveSlot> drives,
                                           const FrameHandler& other = {}, const Tell& tell = {});

// Whether a drive in this state has no power; it then needs nobody to watch over it.
[[nodiscard]] bool is_switched_off(DriveState state) noexcept;

}  // namespace proxarm::fieldbus
