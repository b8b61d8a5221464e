// Turns files into a cycle that can start: builds every part; finds, configures and reads back every device.
//
// Nothing moves here. Errors throw SetupError, which names file and key, or bus, node and object; no drive is then
// enabled.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/udp/udp_port.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

// Index of each of the cell's buses in the network. Two buses on one interface share an index.
using BusIndices = std::vector<std::size_t>;

// Opens a Modbus line. `response_timeout_s` is the timeout of the slowest device on the line.
using ModbusOpener = std::function<std::unique_ptr<fieldbus::ModbusClient>(const description::ModbusLineDescription&,
                                                                           double response_timeout_s)>;
// Returns an opener that calls fieldbus::open_modbus() with these peers.
ModbusOpener opener_of(fieldbus::ModbusPeers peers);

// Opens the port to a force sensor on UDP.
using DatagramOpener = std::function<std::unique_ptr<fieldbus::DatagramPort>(const fieldbus::UdpPeer&)>;
// Returns an opener that calls fieldbus::open_udp() with these peers.
DatagramOpener opener_of(fieldbus::UdpPeers peers);

// Returns the sensor, not started. Throws SetupError if the sensor can't have the cell's base_id, or if its bus is of
// the wrong kind.
std::unique_ptr<fieldbus::ForceSensor> make_sensor(const description::Cell& cell,
                                                   const description::SensorDescription& sensor);

// Throws SetupError if the drives' modes don't suit the scheme. build_parts() checks this, too.
void require_scheme(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError if the settings don't suit the drives on CAN, the bit rates of the drives' buses, or the
// orientation. build_parts() finds the same errors.
void require_timestep(const description::Cell& cell, const SessionSettings& settings);

// Throws SetupError if a tool with a shape has more mass or inertia behind the sensor than the hand is to feel.
void require_felt(const description::Cell& cell, const SessionSettings& settings);

// Returns the felt rotational inertia, kg m², including the part behind the sensor: the requested inertia, or the
// inertia of that part plus the default.
double felt_inertia_kg_m2(const description::Cell& cell, const SessionSettings& settings);

// Builds all parts of the cycle. Throws SetupError. Precondition: `scene` outlives the parts.
CycleParts build_parts(const description::Cell& cell, const description::SensorDescription& sensor,
                       scenes::CompiledScene& scene, const SessionSettings& settings, fieldbus::CanNetwork& network,
                       const BusIndices& bus_indices,
                       const ModbusOpener& open_line = opener_of(fieldbus::ModbusPeers::on_this_machine),
                       const DatagramOpener& open_port = opener_of(fieldbus::UdpPeers::on_this_machine));

// Returns the identifiers that this bus of the network must let through, for the kernel's filters.
std::vector<std::uint32_t> wanted_ids(const CycleParts& parts, std::size_t bus);

// The devices' reports about themselves, one line each.
using Identities = std::vector<std::string>;

// Starts a Modbus line's worker. The worker is a thread, or its substitute in a simulation.
using LineStarter = std::function<void(fieldbus::ModbusLine&)>;

// Configures all devices and reads the configuration back: NMT, SDO, sensor calibration. Afterwards drives are in NMT
// operational and not enabled. Modbus lines run from here on; their rates are measured for 0.25 s. `tell` receives
// messages about further actions, such as the reset of an old error.
Identities bring_up(
    CycleParts& parts, const LineStarter& start_line = [](fieldbus::ModbusLine& line) { line.start(); },
    const fieldbus::Tell& tell = {});

}  // namespace proxarm::controller
