// Starts a session on interfaces: opens the interfaces, filters their frames, and finds the devices.
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

// Makes the kernel pass only frames with these identifiers of a bus from now on. The flag extended_id_flag marks
// identifiers of 29 bits.
void pass_only(fieldbus::SocketCanNetwork& network, std::size_t bus, const std::vector<std::uint32_t>& ids);

// Opens the interfaces. Throws SetupError with the advice that the arm can also be simulated in this process.
fieldbus::SocketCanNetwork open_network(const std::vector<std::string>& interfaces);

// Listens on each bus with drives, and throws SetupError if another controller leads one of the buses (bus_leader.hpp).
// Call this function before a command's first frame. The filters stay set for listening.
void listen_before_speaking(fieldbus::SocketCanNetwork& network, std::span<const fieldbus::DriveSlot> drives);

// Throws SetupError if a Modbus drive hasn't proved that it sends its words in the order that its file states
// (ModbusDrive), and the cell doesn't say that the order was tried.
void require_word_order(const controller::CycleParts& parts);

// Calls listen_before_speaking(), makes the kernel pass only the identifiers of the parts and of `more`, and brings the
// parts up. If a device doesn't answer, the error advises to start `proxarm sim`.
void bring_up_devices(
    fieldbus::SocketCanNetwork& network, controller::CycleParts& parts,
    const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more = [](std::size_t) {
      return std::vector<std::uint32_t>{};
    });

}  // namespace proxarm::command_line
