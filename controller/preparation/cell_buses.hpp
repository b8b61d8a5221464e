// Converts the buses of a cell to the names and indices that networks take.
#pragma once

#include <string>
#include <vector>

#include "controller/session/bring_up.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

std::vector<std::string> bus_names(const description::Cell& cell);

// Returns the indices for a network that has the same buses as the cell, in the same order.
BusIndices buses_in_order(const description::Cell& cell);

// Returns the indices for a network on these interfaces. `interfaces` has one interface for each bus of the cell; buses
// on one interface have the same index.
BusIndices indices_of(const std::vector<std::string>& interfaces);

// Throws SetupError if a bus of the cell with a data bitrate is on an interface that is set up for classic CAN.
void require_fd(const description::Cell& cell, fieldbus::SocketCanNetwork& network);

}  // namespace proxarm::controller
