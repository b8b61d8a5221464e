// What every session on interfaces begins with: the interfaces opened and filtered, the devices found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "controller/session/bring_up.hpp"
#include "fieldbus/can/socket_can_network.hpp"

namespace proxarm::command_line {

// Where each bus of the cell is in the network.
controller::BusIndices indices_in(const fieldbus::SocketCanNetwork& network, std::size_t buses);

// Lets through only what the parts want.
// `more`: identifiers that are wanted besides, by bus.
void set_filters(
    fieldbus::SocketCanNetwork& network, const controller::CycleParts& parts,
    const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more = [](std::size_t) {
      return std::vector<std::uint32_t>{};
    });

// Throws SetupError that adds what can be done without these interfaces: the arm can still be simulated in this
// process.
fieldbus::SocketCanNetwork open_network(const std::vector<std::string>& interfaces);

// bring_up(), with another advice: whoever has no answer on a virtual interface has most likely no simulated arm there.
void bring_up_devices(controller::CycleParts& parts);

}  // namespace proxarm::command_line
