// Configures all drives of a cell side by side and starts them; if one fails, none is started.
//
//   std::vector<ServoDrive> drives;  ...
//   bring_up_drives(network, slots);      // NMT pre-operational, identity, SDO written and read back, NMT start
//   ... the cycle: SYNC, heartbeat, PDOs; the power state machine runs in it ...
//   leave_operational(network, slots);    // after the goodbye (cia402_goodbye.hpp)
//
// Blocks for a few seconds at most; throws SetupError that names bus, node, object, found and expected. Doesn't enable
// any drive: that takes controlwords, which only the cycle sends.
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

// A drive's answers about itself, for the log.
struct DriveIdentity {
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;  // 0 if the drive doesn't report it, as in the next three
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint32_t supported_modes = 0;
  std::vector<std::string> missing;  // optional objects that it lacks: "1006h:00 communication cycle period"
};

[[nodiscard]] std::string describe(const DriveIdentity& identity);

// Objects that the drives lack and the effects, one line each: "drives of axis_1, axis_2: no 6007h:00: …".
[[nodiscard]] std::vector<std::string> losses_of(std::span<const DriveSlot> drives);

// Gets a line for each unusual step: "drive of axis_1 (bus can, node 1): started after …".
using Tell = std::function<void(const std::string&)>;

// Frames of other nodes go to `other`. Refuses two drives with the same node on one bus (several of the cell's buses
// may share an interface). Finally calls start_cycle() of each drive.
std::vector<DriveIdentity> bring_up_drives(CanNetwork& network, std::span<const DriveSlot> drives,
                                           const FrameHandler& other = {}, const Tell& tell = {});

// True if a drive in this state has no power, so that it needn't be watched.
[[nodiscard]] bool is_switched_off(DriveState state) noexcept;

}  // namespace proxarm::fieldbus
