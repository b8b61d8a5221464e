// Configures all drives of a cell side by side and starts them. If one drive fails, no drive is started.
//
//   std::vector<ServoDrive> drives;  ...
//   bring_up_drives(network, slots);      // NMT pre-operational, identity, SDO written and read back, NMT start
//   ... the cycle: SYNC, heartbeat, PDOs; the power state machine runs in it ...
//   leave_operational(network, slots);    // after the goodbye (cia402_goodbye.hpp)
//
// Bringing up blocks for a few seconds at most. It throws SetupError that names bus, node, object, found value and
// expected value. It doesn't enable any drive, because enabling takes controlwords, and only the cycle sends
// controlwords.
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
  std::size_t bus = 0;  // index of the bus in the network
};

// What a drive reports about itself, for the log. Product, revision, serial and supported_modes are 0 if the drive
// doesn't report them.
struct DriveIdentity {
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint32_t supported_modes = 0;
  // Optional objects that the drive lacks, such as "1006h:00 communication cycle period".
  std::vector<std::string> missing;
};

[[nodiscard]] std::string describe(const DriveIdentity& identity);

// Returns one line for each loss with the drives that have it, such as "drives of axis_1, axis_2: no 6007h:00: …".
[[nodiscard]] std::vector<std::string> losses_of(std::span<const DriveSlot> drives);

// Gets a line of text for each unusual step, such as "drive of axis_1 (bus can, node 1): started after …".
using Tell = std::function<void(const std::string&)>;

// Configures and starts the drives, then calls start_cycle() of each drive. `other` gets the frames of other nodes.
// Throws SetupError if two drives have the same node number on one interface, even if the cell lists them under
// different buses (several buses of a cell may share an interface).
std::vector<DriveIdentity> bring_up_drives(CanNetwork& network, std::span<const DriveSlot> drives,
                                           const FrameHandler& other = {}, const Tell& tell = {});

// True if a drive in this state has no power, so it needn't be watched.
[[nodiscard]] bool is_switched_off(DriveState state) noexcept;

}  // namespace proxarm::fieldbus
