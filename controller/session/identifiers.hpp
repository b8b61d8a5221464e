// Which identifiers the devices of a cell have on CAN: judged by the files alone, before a bus is opened.
#pragma once

#include "controller/session/bring_up.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"

namespace proxarm::controller {

// Throws SetupError with the cell's file, line and key where the sensor can't be had as the cell has it, or where the
// sensor or the enabling input has an identifier of the controller, of a drive or of the other on one bus. Drives have
// theirs by their nodes. `bus_indices` says which of the cell's buses share an interface.
void require_own_identifiers(const description::Cell& cell, const description::SensorDescription& sensor,
                             const SessionSettings& settings, const BusIndices& bus_indices);

}  // namespace proxarm::controller
