// The start of every session on interfaces: opens and filters the interfaces and finds the devices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "controller/session/bring_up.hpp"
#include "fieldbus/can/socket_can_network.hpp"

namespace proxarm::command_line {

// Returns the network's bus for each bus of the cell.
controller::BusIndices indices_in(const fieldbus::SocketCanNetwork& network, std::size_t buses);

// Makes the kernel pass only these identifiers of a bus from now on; extended_id_flag marks identifiers of 29 bits.
void pass_only(fieldbus::SocketCanNetwork& network, std::size_t bus, const std::vector<std::uint32_t>& ids);

// Throws SetupError, with the advice that the arm can also be simulated in this process.
fieldbus::SocketCanNetwork open_network(const std::vector<std::string>& interfaces);

// Call it before a command's first frame. Listens on each bus with drives, and throws SetupError if another controller
// leads one (bus_leader.hpp). Leaves the filters set for listening.
void listen_before_speaking(fieldbus::SocketCanNetwork& network, std::span<const fieldbus::DriveSlot> drives);

// Throws SetupError if nothing proves that a Modbus drive sends its words in the file's order (ModbusDrive), and the
// cell doesn't say that this was tried.
void require_word_order(const controller::CycleParts& parts);

// Listens, passes only the parts' identifiers and `more`, and brings the parts up. An error about a missing answer
// advises to start `proxarm sim`.
void bring_up_devices(
    fieldbus::SocketCanNetwork& network, controller::CycleParts& parts,
    const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more = [](std::size_t) {
      return std::vector<std::uint32_t>{};
    });

}  // namespace proxarm::command_line
