// Checks the CAN identifiers of a cell's devices by means of the files alone, before a bus is opened.
#pragma once

#include "controller/session/bring_up.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"

namespace proxarm::controller {

// Throws SetupError with the cell's file, line and key in two cases. First: the cell's choices for the sensor are
// invalid. Second: two of sensor, enabling input, controller and drives have the same identifier on one bus, and one of
// these two is the sensor or the enabling input. `bus_indices` says which of the cell's buses share an interface.
void require_own_identifiers(const description::Cell& cell, const description::SensorDescription& sensor,
                             const SessionSettings& settings, const BusIndices& bus_indices);

}  // namespace proxarm::controller
