#include "controller/bring_up.hpp"

#include <algorithm>
#include <cmath>

#include "fieldbus/ati_net_can_oem.hpp"
#include "fieldbus/canopen_pdo.hpp"
#include "fieldbus/described_sensor.hpp"
#include "fieldbus/identifier_check.hpp"
#include "models/description/eds_bitrates.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::controller {
namespace {

using description::SetupError;

constexpr std::int64_t rate_measurement_ns = 250'000'000;

std::size_t index_of(const description::Cell& cell, const std::string& bus) {
  const auto found = std::find_if(cell.buses.begin(), cell.buses.end(),
                                  [&](const description::BusDescription& b) { return b.name == bus; });
  return static_cast<std::size_t>(found - cell.buses.begin());
}

fieldbus::DriveSettings drive_settings(const SessionSettings& settings) {
  fieldbus::DriveSettings drive;
  drive.period_ns = std::llround(settings.period_s * 1e9);
  drive.heartbeat_in_operation = false;
  return drive;
}

std::vector<DriveBus> drive_buses(const std::vector<DriveOnBus>& drives) {
  const fieldbus::DriveSettings defaults;
  std::vector<DriveBus> buses;
  for (const DriveOnBus& axis : drives) {
    if (axis.on_can == nullptr) continue;
    const bool known = std::any_of(buses.begin(), buses.end(), [&](const DriveBus& b) { return b.bus == axis.bus; });
    if (known) continue;
    buses.push_back(
        {axis.bus, fieldbus::SyncProducer(),
         fieldbus::HeartbeatProducer(defaults.master_node, std::int64_t{defaults.master_heartbeat_ms} * 1'000'000)});
  }
  return buses;
}

DriveOnBus make_drive(const description::Cell& cell, const description::DriveDescription& drive,
                      const SessionSettings& settings, const BusIndices& bus_indices) {
  if (drive.on_can()) {
    fieldbus::DriveSettings own = drive_settings(settings);
    const bool has_inputs = cell.enabling_input && cell.enabling_input->drive == drive.joint;
    if (has_inputs && !settings.without_enabling_input) own.inputs_object = cell.enabling_input->object;
    auto servo = std::make_unique<fieldbus::ServoDrive>(drive, own);
    fieldbus::ServoDrive& on_can = *servo;
    const std::size_t bus = index_of(cell, drive.bus);
    if (!drive.eds.empty()) description::require_bitrate(drive.eds, cell.buses[bus].bitrate);
    return {std::move(servo), on_can, &on_can, bus_indices[bus]};
  }
  auto modbus = std::make_unique<fieldbus::ModbusDrive>(drive, description::load_modbus_drive(drive.description),
                                                        std::llround(settings.period_s * 1e9));
  fieldbus::ModbusDrive& on_line = *modbus;
  return {std::move(modbus), on_line, nullptr, DriveOnBus::no_bus};
}

// One worker and one connection per line. A TCP drive has an address of its own, and thereby a line of its own; units
// behind a gateway share its.
std::vector<std::unique_ptr<fieldbus::ModbusLine>> modbus_lines(const description::Cell& cell,
                                                                std::vector<DriveOnBus>& drives,
                                                                fieldbus::ForceSensor& sensor,
                                                                const std::string& sensor_bus,
                                                                const ModbusOpener& open_line) {
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> lines;
  for (const description::ModbusLineDescription& line : cell.modbus_lines) {
    std::vector<fieldbus::ModbusDrive*> on_it;
    for (DriveOnBus& axis : drives) {
      if (axis.on_can != nullptr || axis.drive.description().bus != line.name) continue;
      on_it.push_back(static_cast<fieldbus::ModbusDrive*>(&axis.drive));
    }
    auto* sensor_on_it = line.name == sensor_bus ? static_cast<fieldbus::ModbusSensor*>(&sensor) : nullptr;
    if (on_it.empty() && sensor_on_it == nullptr) continue;
    double timeout_s = sensor_on_it != nullptr ? sensor_on_it->response_timeout_s() : 0.0;
    for (const auto* drive : on_it) timeout_s = std::max(timeout_s, drive->registers().response_timeout_s);
    lines.push_back(std::make_unique<fieldbus::ModbusLine>(line, open_line(line, timeout_s), on_it, sensor_on_it));
  }
  return lines;
}

// One joint per cycle may turn as far as its speed allows.
models::InverseKinematicsConfig inverse_config(const description::Cell& cell, double period_s) {
  models::InverseKinematicsConfig config;
  for (std::size_t i = 0; i < cell.drives.size() && i < config.max_step_rad.size(); ++i) {
    config.max_step_rad[i] = cell.drives[i].max_speed_rad_per_s * period_s;
  }
  return config;
}

// The tool behind the sensor is felt by itself; (26) gets what is left of the wanted mass.
double proxy_mass(const description::Cell& cell, const SessionSettings& settings) {
  if (settings.mass_kg > cell.tool.mass_kg) return settings.mass_kg - cell.tool.mass_kg;
  throw SetupError({.key = "--mass",
                    .found = description::number_text(settings.mass_kg) + " kg",
                    .expected = "more than " + description::number_text(cell.tool.mass_kg) +
                                " kg: the tool behind the sensor alone has that, and is felt in full",
                    .advice = "ask for more mass, or use a lighter tool"});
}

OrientationConfig orientation_config(const SessionSettings& settings) {
  OrientationConfig config;
  config.free = settings.orientation == OrientationMode::free;
  config.inertia_kg_m2 = settings.rotational_inertia_kg_m2;
  config.damping_Nms_per_rad = settings.rotational_damping_Nms_per_rad;
  config.period_s = settings.period_s;
  return config;
}

ImpedanceConfig impedance_config(const SessionSettings& settings) {
  return {.stiffness_N_per_m = settings.coupling_stiffness_N_per_m,
          .damping_Ns_per_m = settings.coupling_damping_Ns_per_m,
          .period_s = settings.period_s};
}

std::optional<EnablingInput> make_enabling_input(const description::Cell& cell, const SessionSettings& settings,
                                                 const BusIndices& bus_indices) {
  if (!cell.enabling_input || settings.without_enabling_input) return std::nullopt;
  return EnablingInput(*cell.enabling_input, cell, bus_indices[index_of(cell, cell.enabling_input->bus)]);
}

std::vector<fieldbus::DriveSlot> slots(CycleParts& parts) {
  std::vector<fieldbus::DriveSlot> slots;
  for (DriveOnBus& axis : parts.drives) {
    if (axis.on_can != nullptr) slots.push_back({axis.on_can, axis.bus});
  }
  return slots;
}

// Several of the cell's buses may be on one interface; the controller itself has NMT, SYNC and its heartbeat there.
void refuse_shared_identifiers(CycleParts& parts) {
  std::vector<fieldbus::UsedIdentifier> used;
  std::vector<std::string> names;
  for (std::size_t bus = 0; bus < parts.network.bus_count(); ++bus) names.push_back(parts.network.bus(bus).name());
  for (const DriveBus& bus : parts.drive_buses) {
    for (const std::uint32_t id :
         {0x000U, fieldbus::sync_id, fieldbus::heartbeat_id(fieldbus::DriveSettings{}.master_node)}) {
      used.push_back({bus.bus, id, "the controller"});
    }
  }
  for (const DriveOnBus& axis : parts.drives) {
    if (axis.on_can == nullptr) continue;
    for (const std::uint32_t id : axis.on_can->used_ids()) {
      used.push_back({axis.bus, id, "drive of " + axis.drive.description().joint});
    }
  }
  for (const std::uint32_t id : parts.sensor->used_ids()) used.push_back({parts.sensor_bus, id, "force sensor"});
  if (parts.enabling) used.push_back({parts.enabling->bus(), parts.enabling->wanted_id(), "enabling input"});
  fieldbus::refuse_shared_identifiers(used, names);
}

}  // namespace

std::unique_ptr<fieldbus::ForceSensor> make_sensor(const description::Cell& cell,
                                                   const description::SensorDescription& sensor) {
  const bool on_line = index_of(cell, cell.sensor.bus) == cell.buses.size();
  if (on_line != (sensor.described && sensor.described->registers)) {
    throw SetupError({.file = cell.file.string(),
                      .key = "sensor.bus",
                      .found = description::in_quotes(cell.sensor.bus),
                      .expected = on_line ? "a CAN bus: " + sensor.name + " sends frames"
                                          : "a Modbus line: " + sensor.name + " has registers"});
  }
  if (on_line) return std::make_unique<fieldbus::ModbusSensor>(sensor, cell.sensor.base_id, cell.sensor.bus);
  if (sensor.protocol == "ati_net_can_oem") {
    fieldbus::AtiNetCanOemSettings settings;
    settings.bus_name = cell.sensor.bus;
    settings.base_id = cell.sensor.base_id;
    return std::make_unique<fieldbus::AtiNetCanOem>(settings);
  }
  fieldbus::DescribedSensorSettings settings;
  settings.bus_name = cell.sensor.bus;
  settings.base_id = cell.sensor.base_id;
  return std::make_unique<fieldbus::DescribedSensor>(sensor, settings);
}

// Torques for drives that take them, positions for those that don't.
void require_scheme(const description::Cell& cell, const SessionSettings& settings) {
  const bool torque = settings.scheme == Scheme::impedance;
  for (const description::DriveDescription& drive : cell.drives) {
    if ((drive.mode == "cst") == torque) continue;
    throw SetupError(
        {.file = cell.file.string(),
         .key = "--scheme",
         .found = torque ? "impedance" : "admittance",
         .expected = torque ? "admittance: the drive of " + drive.joint + " takes positions (mode " + drive.mode + ")"
                            : "impedance: the drive of " + drive.joint + " takes torques (mode cst)",
         .advice = torque ? "the impedance type needs mode: cst for all drives" : ""});
  }
}

ModbusOpener opener_of(fieldbus::ModbusPeers peers) {
  return [peers](const description::ModbusLineDescription& line, double response_timeout_s) {
    return fieldbus::open_modbus(line, response_timeout_s, peers);
  };
}

CycleParts build_parts(const description::Cell& cell, const description::SensorDescription& sensor,
                       scenes::CompiledScene& scene, const SessionSettings& settings, fieldbus::CanNetwork& network,
                       const BusIndices& bus_indices, const ModbusOpener& open_line) {
  require_scheme(cell, settings);
  std::vector<DriveOnBus> drives;
  for (const description::DriveDescription& drive : cell.drives) {
    drives.push_back(make_drive(cell, drive, settings, bus_indices));
  }
  std::unique_ptr<fieldbus::ForceSensor> force_sensor = make_sensor(cell, sensor);
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> lines =
      modbus_lines(cell, drives, *force_sensor, cell.sensor.bus, open_line);
  auto arm = std::make_unique<models::Arm>(cell);
  std::optional<models::InverseKinematics> inverse;
  std::unique_ptr<RenderedWorld> world;
  std::unique_ptr<TorqueRendering> torque;
  if (settings.scheme == Scheme::impedance) {
    torque = make_torque_rendering(scene, *arm, cell.drives, cell.limits, impedance_config(settings));
  } else {
    inverse.emplace(*arm, inverse_config(cell, settings.period_s));
    world = make_rendered_world(scene, settings, proxy_mass(cell, settings));
  }
  std::unique_ptr<FreeMotion> freeing;
  if (!torque) freeing = std::make_unique<FreeMotion>(settings, cell.supervision.release_speed_m_per_s);
  ElasticSetpoint elastic(*arm, cell.limits.setpoint_bandwidth_Hz, settings.period_s);
  std::vector<DriveBus> buses = drive_buses(drives);
  const std::size_t sensor_bus = index_of(cell, cell.sensor.bus);
  return CycleParts{network,
                    std::move(drives),
                    std::move(buses),
                    std::move(force_sensor),
                    sensor_bus < bus_indices.size() ? bus_indices[sensor_bus] : DriveOnBus::no_bus,
                    std::move(lines),
                    std::move(arm),
                    std::move(inverse),
                    std::move(elastic),
                    std::move(world),
                    std::move(torque),
                    OrientationProxy(orientation_config(settings)),
                    WrenchCompensation(cell),
                    make_enabling_input(cell, settings, bus_indices),
                    std::move(freeing),
                    cell.supervision};
}

std::vector<std::uint32_t> wanted_ids(const CycleParts& parts, std::size_t bus) {
  std::vector<std::uint32_t> ids;
  for (const DriveOnBus& axis : parts.drives) {
    if (axis.on_can == nullptr || axis.bus != bus) continue;
    for (const std::uint32_t id : axis.on_can->wanted_ids()) ids.push_back(id);
    // Of another master.
    ids.push_back(fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, axis.on_can->node()));
  }
  if (!ids.empty()) {
    for (const std::uint32_t id :
         {0x000U, fieldbus::sync_id, fieldbus::heartbeat_id(fieldbus::DriveSettings{}.master_node)}) {
      ids.push_back(id);
    }
  }
  if (bus == parts.sensor_bus) {
    for (const std::uint32_t id : parts.sensor->wanted_ids()) ids.push_back(id);
  }
  if (parts.enabling && parts.enabling->bus() == bus) ids.push_back(parts.enabling->wanted_id());
  return ids;
}

Identities bring_up(CycleParts& parts, const LineStarter& start_line) {
  refuse_shared_identifiers(parts);
  Identities lines;
  parts.sensor->start(parts.network, parts.sensor_bus);
  lines.push_back("sensor: " + parts.sensor->identity());
  for (const auto& line : parts.modbus_lines) {
    line->start_up(parts.network.now_ns());
    start_line(*line);
  }
  if (!parts.modbus_lines.empty()) parts.network.sleep_until(parts.network.now_ns() + rate_measurement_ns);
  const std::vector<fieldbus::DriveSlot> drives = slots(parts);
  const std::vector<fieldbus::DriveIdentity> identities = fieldbus::bring_up_drives(parts.network, drives);
  for (std::size_t i = 0; i < identities.size(); ++i) {
    lines.push_back("drive of " + drives[i].drive->description().joint + ": " + describe(identities[i]));
  }
  for (DriveOnBus& axis : parts.drives) {
    if (axis.on_can != nullptr) continue;
    axis.drive.on_sync(parts.network.now_ns());
    lines.push_back(axis.drive.describe());
  }
  return lines;
}

}  // namespace proxarm::controller
