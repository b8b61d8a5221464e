// Turns files into a cycle that can start: builds every part; finds, configures and reads back every device.
//
// Nothing moves here. Throws SetupError that names file and key, or bus, node and object; no drive is then enabled.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

// Each bus of the cell: its index in the network. Two buses on one interface share an index.
using BusIndices = std::vector<std::size_t>;

// Opens a Modbus line; the response timeout is that of the slowest device on it.
using ModbusOpener = std::function<std::unique_ptr<fieldbus::ModbusClient>(const description::ModbusLineDescription&,
                                                                           double response_timeout_s)>;
// Through fieldbus::open_modbus().
ModbusOpener opener_of(fieldbus::ModbusPeers peers);

// Throws SetupError if the sensor can't have the cell's base_id, or its bus is of the wrong kind.
std::unique_ptr<fieldbus::ForceSensor> make_sensor(const description::Cell& cell,
                                                   const description::SensorDescription& sensor);

// Throws SetupError if the drives' modes don't suit the scheme. build_parts() checks this, too.
void require_scheme(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError if these settings don't suit the drives on CAN, their buses' bit rates or the orientation.
// build_parts() finds the same errors.
void require_timestep(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError if a tool with a shape has more inertia behind the sensor than is to be felt.
void require_felt(const description::Cell& cell, const SessionSettings& settings);

// Felt rotational inertia, kg m², including the part behind the sensor: the requested one, or that part plus the
// default.
double felt_inertia_kg_m2(const description::Cell& cell, const SessionSettings& settings);

// Precondition: `scene` outlives the parts.
CycleParts build_parts(const description::Cell& cell, const description::SensorDescription& sensor,
                       scenes::CompiledScene& scene, const SessionSettings& settings, fieldbus::CanNetwork& network,
                       const BusIndices& bus_indices,
                       const ModbusOpener& open_line = opener_of(fieldbus::ModbusPeers::on_this_machine));

// Identifiers that this bus of the network must let through, for the kernel's filters.
std::vector<std::uint32_t> wanted_ids(const CycleParts& parts, std::size_t bus);

// What the devices reported about themselves, one line each.
using Identities = std::vector<std::string>;

// Starts a Modbus line's worker: a thread, or its substitute in a simulation.
using LineStarter = std::function<void(fieldbus::ModbusLine&)>;

// NMT, SDO configuration with reading back, sensor calibration. Drives end in NMT operational, not enabled. Modbus
// lines keep running, with their rates measured for 0.25 s. `tell` receives other actions, such as a reset of an old
// error.
Identities bring_up(
    CycleParts& parts, const LineStarter& start_line = [](fieldbus::ModbusLine& line) { line.start(); },
    const fieldbus::Tell& tell = {});

}  // namespace proxarm::controller
