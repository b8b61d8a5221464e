// What every session on interfaces begins with: the interfaces opened and filtered, the devices found.
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

// Where each bus of the cell is in the network.
controller::BusIndices indices_in(const fieldbus::SocketCanNetwork& network, std::size_t buses);

// The kernel passes only these identifiers of a bus from now on; with extended_id_flag those of 29 bits.
void pass_only(fieldbus::SocketCanNetwork& network, std::size_t bus, const std::vector<std::uint32_t>& ids);

// Throws SetupError that adds what can be done without these interfaces: the arm can still be simulated in this
// process.
fieldbus::SocketCanNetwork open_network(const std::vector<std::string>& interfaces);

// What comes before the first frame that a command sends: listens on each bus with drives, and throws SetupError where
// somebody leads one (bus_leader.hpp). The buses' filters are those for listening afterwards.
void listen_before_speaking(fieldbus::SocketCanNetwork& network, std::span<const fieldbus::DriveSlot> drives);

// Throws SetupError where nothing shows that a Modbus drive's words come in the file's order (ModbusDrive), and the
// cell doesn't say that somebody has tried it.
void require_word_order(const controller::CycleParts& parts);

// Listens, lets through only what the parts want, and brings them up. With another advice: whoever has no answer on a
// virtual interface has most likely no simulated arm there. `more`: identifiers that are wanted besides, by bus.
void bring_up_devices(
    fieldbus::SocketCanNetwork& network, controller::CycleParts& parts,
    const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more = [](std::size_t) {
      return std::vector<std::uint32_t>{};
    });

}  // namespace proxarm::command_line
