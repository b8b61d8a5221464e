// Converts the buses of a cell to what the networks take.
#pragma once

#include <string>
#include <vector>

#include "controller/session/bring_up.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "models/description/cell.hpp"

namespace proxarm::command_line {

std::vector<std::string> bus_names(const description::Cell& cell);

// For a network that has the cell's buses in the same order.
controller::BusIndices buses_in_order(const description::Cell& cell);

// For a network on these interfaces, one for each bus of the cell. Buses on one interface share its wire.
controller::BusIndices indices_of(const std::vector<std::string>& interfaces);

// Throws SetupError if a bus with a data bitrate is on an interface that is set up for classic CAN.
void require_fd(const description::Cell& cell, fieldbus::SocketCanNetwork& network);

}  // namespace proxarm::command_line
