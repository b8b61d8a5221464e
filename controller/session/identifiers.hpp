// Checks the CAN identifiers of a cell's devices from the files alone, before a bus is opened.
#pragma once

#include "controller/session/bring_up.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"

namespace proxarm::controller {

// Throws SetupError with the cell's file, line and key if the cell's choices for the sensor are invalid, or if sensor
// or enabling input share an identifier on one bus with the controller, a drive or each other. `bus_indices` tells
// which of the cell's buses share an interface.
void require_own_identifiers(const description::Cell& cell, const description::SensorDescription& sensor,
                             const SessionSettings& settings, const BusIndices& bus_indices);

}  // namespace proxarm::controller
