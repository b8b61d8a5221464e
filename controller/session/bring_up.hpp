// From files to a cycle that can start: every part built, every device found, configured and read back.
//
// Nothing moves here. Throws SetupError that names file and key, or bus, node and object; then nothing was enabled.
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

// Where each bus of the cell is in the network; two buses on one interface have one index.
using BusIndices = std::vector<std::size_t>;

// Opens a Modbus line; the response timeout is that of the slowest device on it.
using ModbusOpener = std::function<std::unique_ptr<fieldbus::ModbusClient>(const description::ModbusLineDescription&,
                                                                           double response_timeout_s)>;
// Through fieldbus::open_modbus().
ModbusOpener opener_of(fieldbus::ModbusPeers peers);

// Throws SetupError where the cell's base_id isn't one of the sensor's, or its bus is of the wrong kind.
std::unique_ptr<fieldbus::ForceSensor> make_sensor(const description::Cell& cell,
                                                   const description::SensorDescription& sensor);

// Throws SetupError where the drives' modes can't render that way. build_parts() asks, too.
void require_scheme(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError where the drives on CAN, their buses' bit rates or the orientation can't have these settings;
// build_parts() finds the same in its parts.
void require_timestep(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError where more inertia hangs behind the sensor of a tool with a shape than is to be felt.
void require_felt(const description::Cell& cell, const SessionSettings& settings);

// What the hand feels of the tool's rotation, what is behind the sensor included: as asked, or the default above it.
double felt_inertia_kg_m2(const description::Cell& cell, const SessionSettings& settings);

// `scene` must outlive the parts.
CycleParts build_parts(const description::Cell& cell, const description::SensorDescription& sensor,
                       scenes::CompiledScene& scene, const SessionSettings& settings, fieldbus::CanNetwork& network,
                       const BusIndices& bus_indices,
                       const ModbusOpener& open_line = opener_of(fieldbus::ModbusPeers::on_this_machine));

// Identifiers that a bus of the network must let through, for the kernel's filters.
std::vector<std::uint32_t> wanted_ids(const CycleParts& parts, std::size_t bus);

// What the devices said of themselves, a line each.
using Identities = std::vector<std::string>;

// Sets a Modbus line's worker going: a thread, or what a simulation has for one.
using LineStarter = std::function<void(fieldbus::ModbusLine&)>;

// NMT, SDO configuration written and read back, sensor calibration read; drives end in NMT operational, not enabled.
// Modbus lines are left running, and their rates have been measured for a quarter of a second. `tell` gets what drives
// needed besides, such as what was done against an error from before.
Identities bring_up(
    CycleParts& parts, const LineStarter& start_line = [](fieldbus::ModbusLine& line) { line.start(); },
    const fieldbus::Tell& tell = {});

}  // namespace proxarm::controller
