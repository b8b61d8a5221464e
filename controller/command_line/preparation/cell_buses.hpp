// The buses of a cell, as the networks want them.
#pragma once

#include <string>
#include <vector>

#include "controller/session/bring_up.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "models/description/cell.hpp"

namespace proxarm::command_line {

std::vector<std::string> bus_names(const description::Cell& cell);

// For a network that has the cell's buses in the cell's order.
controller::BusIndices buses_in_order(const description::Cell& cell);

// For one that is on these interfaces, one for each of the cell's buses: two on one interface share its wire.
controller::BusIndices indices_of(const std::vector<std::string>& interfaces);

// Throws SetupError where a bus with a data bitrate is to be on an interface that is set up for classic CAN.
void require_fd(const description::Cell& cell, fieldbus::SocketCanNetwork& network);

}  // namespace proxarm::command_line
