#include "controller/session/bring_up.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "controller/arm_step/arm_step.hpp"
#include "controller/stability/elastic_loop.hpp"
#include "controller/supervision/drive_monitor.hpp"
#include "fieldbus/budget/identifier_check.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "fieldbus/sensors/described_sensor.hpp"
#include "fieldbus/udp/datagram_sensor.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/eds_bitrates.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::controller {
namespace {

using description::SetupError;

constexpr std::int64_t rate_measurement_ns = 250'000'000;

// Returns the bus's index in the cell; cell.buses.size() for a Modbus line.
std::size_t index_of(const description::Cell& cell, const std::string& bus) {
  const auto found = std::find_if(cell.buses.begin(), cell.buses.end(),
                                  [&](const description::BusDescription& b) { return b.name == bus; });
  return static_cast<std::size_t>(found - cell.buses.begin());
}

fieldbus::DriveSettings drive_settings(const description::Cell& cell, const SessionSettings& settings) {
  fieldbus::DriveSettings drive;
  drive.period_ns = std::llround(settings.period_s * 1e9);
  drive.stop_without_controller(cell.supervision.bus_loss_stop_s);
  // The drive's heartbeat frame could delay a bus's last setpoint beyond the deadline: docs/explanation/design.md.
  drive.heartbeat_in_operation = false;
  return drive;
}

std::vector<DriveBus> drive_buses(const std::vector<fieldbus::DriveSlot>& drives) {
  std::vector<DriveBus> buses;
  for (const fieldbus::DriveSlot& slot : drives) {
    const bool known = std::any_of(buses.begin(), buses.end(), [&](const DriveBus& b) { return b.bus == slot.bus; });
    if (known) continue;
    buses.push_back(
        {slot.bus, fieldbus::SyncProducer(),
         fieldbus::HeartbeatProducer(slot.drive->settings().master_node,
                                     std::int64_t{slot.drive->settings().master_heartbeat_ms} * 1'000'000)});
  }
  return buses;
}

// All drives in the order of the joints. `can` and `modbus` point to drives in `all`.
struct Drives {
  std::vector<DriveOnBus> all;
  std::vector<fieldbus::DriveSlot> can;
  std::vector<fieldbus::ModbusDrive*> modbus;
};

// Sets 6065h and 6066h, by which the drive judges its following error a little later than the controller does
// (drive_monitor.hpp). 6065h, the window, is the lag at the highest speed plus the deviation that is a fault at once.
// 6066h, the time, is what the setpoint needs to brake and return if a joint jams at the highest speed.
void watch_following(fieldbus::DriveSettings& settings, const description::DriveDescription& drive,
                     double following_error_rad) {
  const double v = drive.max_speed_rad_per_s, a = drive.max_acceleration_rad_per_s2;
  settings.following_error_window_rad =
      away_at_once * following_error_rad + v / (2.0 * std::numbers::pi * drive.position_bandwidth_Hz);
  const double time_ms = 1e3 * (2.5 * v / a + deviates_s);
  settings.following_error_time_ms = static_cast<std::uint16_t>(std::clamp(std::ceil(time_ms), 1.0, 65535.0));
}

std::unique_ptr<fieldbus::ServoDrive> make_can_drive(const description::Cell& cell,
                                                     const description::DriveDescription& drive,
                                                     const SessionSettings& settings) {
  fieldbus::DriveSettings own = drive_settings(cell, settings);
  const bool has_inputs = cell.enabling_input && cell.enabling_input->drive == drive.joint;
  if (has_inputs && !settings.without_enabling_input) own.inputs_object = cell.enabling_input->object;
  watch_following(own, drive, cell.limits.following_error_rad);
  auto servo = std::make_unique<fieldbus::ServoDrive>(drive, own);
  if (!drive.eds.empty()) {
    description::require_bitrate(drive.eds, cell.buses[index_of(cell, drive.bus)].bitrate);
  }
  return servo;
}

Drives make_drives(const description::Cell& cell, const SessionSettings& settings, const BusIndices& bus_indices) {
  Drives drives;
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.on_can()) {
      auto servo = make_can_drive(cell, drive, settings);
      const std::size_t bus = bus_indices[index_of(cell, drive.bus)];
      fieldbus::ServoDrive& made = *servo;
      drives.can.push_back({&made, bus});
      drives.all.push_back({std::move(servo), made, bus});
    } else {
      auto on_line = std::make_unique<fieldbus::ModbusDrive>(drive, description::load_modbus_drive(drive.description),
                                                             std::llround(settings.period_s * 1e9));
      fieldbus::ModbusDrive& made = *on_line;
      drives.modbus.push_back(&made);
      drives.all.push_back({std::move(on_line), made, DriveOnBus::no_bus});
    }
  }
  return drives;
}

struct Sensor {
  std::unique_ptr<fieldbus::ForceSensor> owned;
  fieldbus::ModbusSensor* on_line = nullptr;  // points to `owned`; null for a sensor on a CAN bus
};

// For a sensor that is only asked about itself.
std::unique_ptr<fieldbus::DatagramPort> no_port(const fieldbus::UdpPeer&) {
  return std::make_unique<fieldbus::NoDatagrams>();
}

std::unique_ptr<fieldbus::ForceSensor> udp_sensor(const description::Cell& cell,
                                                  const description::SensorDescription& sensor,
                                                  const DatagramOpener& open_port) {
  if (cell.sensor.base_id != 0) {
    throw SetupError({.file = cell.file.string(),
                      .key = "sensor.base_id",
                      .found = std::to_string(cell.sensor.base_id),
                      .expected = "none: a sensor on UDP has an address instead, sensor.host"});
  }
  const fieldbus::UdpPeer peer = fieldbus::peer_of(cell.sensor, sensor);
  return std::make_unique<fieldbus::DatagramSensor>(
      sensor, open_port(peer), fieldbus::DatagramSensorSettings{.peer = fieldbus::peer_text(peer)});
}

Sensor build_sensor(const description::Cell& cell, const description::SensorDescription& sensor,
                    const DatagramOpener& open_port) {
  const bool has_datagrams = sensor.described && sensor.described->datagrams;
  if (has_datagrams != cell.sensor.on_udp()) {
    throw SetupError({.file = cell.file.string(),
                      .key = has_datagrams ? "sensor.bus" : "sensor.host",
                      .found = description::in_quotes(has_datagrams ? cell.sensor.bus : cell.sensor.host),
                      .expected = has_datagrams ? "sensor.host in its place: " + sensor.name + " sends UDP datagrams"
                                                : "sensor.bus in its place: " + sensor.name + " is on a bus"});
  }
  if (has_datagrams) return {udp_sensor(cell, sensor, open_port)};
  const bool on_line = index_of(cell, cell.sensor.bus) == cell.buses.size();
  if (on_line != (sensor.described && sensor.described->registers)) {
    throw SetupError({.file = cell.file.string(),
                      .key = "sensor.bus",
                      .found = description::in_quotes(cell.sensor.bus),
                      .expected = on_line ? "a CAN bus: " + sensor.name + " sends frames"
                                          : "a Modbus line: " + sensor.name + " has registers"});
  }
  if (on_line) {
    auto made = std::make_unique<fieldbus::ModbusSensor>(sensor, cell.sensor.base_id, cell.sensor.bus);
    fieldbus::ModbusSensor* const same = made.get();
    return {std::move(made), same};
  }
  if (sensor.protocol == "ati_net_can_oem") {
    fieldbus::AtiNetCanOemSettings settings;
    settings.bus_name = cell.sensor.bus;
    settings.base_id = cell.sensor.base_id;
    return {std::make_unique<fieldbus::AtiNetCanOem>(settings)};
  }
  fieldbus::DescribedSensorSettings settings;
  settings.bus_name = cell.sensor.bus;
  settings.base_id = cell.sensor.base_id;
  return {std::make_unique<fieldbus::DescribedSensor>(sensor, settings)};
}

// Returns the lines with a worker and a connection each. A TCP drive has its own line; units behind a gateway share a
// line.
std::vector<std::unique_ptr<fieldbus::ModbusLine>> modbus_lines(const description::Cell& cell,
                                                                const std::vector<fieldbus::ModbusDrive*>& drives,
                                                                fieldbus::ModbusSensor* sensor,
                                                                const ModbusOpener& open_line) {
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> lines;
  for (const description::ModbusLineDescription& line : cell.modbus_lines) {
    std::vector<fieldbus::ModbusDrive*> on_it;
    for (fieldbus::ModbusDrive* drive : drives) {
      if (drive->description().bus == line.name) on_it.push_back(drive);
    }
    fieldbus::ModbusSensor* const sensor_on_it = line.name == cell.sensor.bus ? sensor : nullptr;
    if (on_it.empty() && sensor_on_it == nullptr) continue;
    double timeout_s = sensor_on_it != nullptr ? sensor_on_it->response_timeout_s() : 0.0;
    for (const auto* drive : on_it) timeout_s = std::max(timeout_s, drive->registers().response_timeout_s);
    lines.push_back(std::make_unique<fieldbus::ModbusLine>(line, open_line(line, timeout_s), on_it, sensor_on_it));
  }
  return lines;
}

// The tool behind the sensor is felt by itself. (26) gets the rest of the wanted mass.
double proxy_mass(const description::Cell& cell, const SessionSettings& settings) {
  if (settings.mass_kg > cell.tool.mass_kg) return settings.mass_kg - cell.tool.mass_kg;
  throw SetupError({.key = "--mass",
                    .found = description::number_text(settings.mass_kg) + " kg",
                    .expected = "more than " + description::number_text(cell.tool.mass_kg) +
                                " kg: the tool behind the sensor alone has that, and is felt in full",
                    .advice = "ask for more mass, or use a lighter tool"});
}

// Returns the bounds of the tool's rotation from its orientation at the first start. The bounds are smaller than the
// cell's limits by a lead, since setpoints lead the links (turn_sets.hpp).
TurnSets turn_sets(const description::Cell& cell) {
  const description::CellLimits& limits = cell.limits;
  TurnSets sets;
  sets.max_turn_rad = TurnSets::lead_rad.before(limits.max_turn_rad);
  if (limits.max_tilt_rad) sets.axis_range.max_tilt_rad = TurnSets::lead_rad.before(*limits.max_tilt_rad);
  if (limits.max_twist_rad) sets.axis_range.max_twist_rad = TurnSets::lead_rad.before(*limits.max_twist_rad);
  sets.axis_range.axis_T = models::Vec3(limits.tilt_axis[0], limits.tilt_axis[1], limits.tilt_axis[2]);
  sets.max_speed_rad_per_s = TurnSets::lead_rad_per_s.before(limits.max_turning_speed_rad_per_s);
  sets.brakes_s = ArmStep::braking_s(cell.drives);
  return sets;
}

OrientationConfig orientation_config(const description::Cell& cell, const SessionSettings& settings) {
  OrientationConfig config;
  config.free = settings.orientation == OrientationMode::free;
  config.inertia_kg_m2 = default_inertia_kg_m2;
  if (settings.rotational_inertia_kg_m2 > 0.0) {
    config.inertia_kg_m2 = settings.rotational_inertia_kg_m2;
    config.behind_sensor_T = models::tool_inertia(cell.tool).about_T_kg_m2;
  }
  config.damping_Nms_per_rad = settings.rotational_damping_Nms_per_rad;
  config.spring_Nm_per_rad = settings.rotational_spring_Nm_per_rad;
  config.turn = turn_sets(cell);
  config.period_s = settings.period_s;
  return config;
}

// Returns the configuration of a rigid tool. The part behind the sensor is subtracted from the felt mass and from the
// felt inertia, also from the default inertia.
PoseWorldConfig pose_config(const description::Cell& cell, const SessionSettings& settings) {
  const models::ToolInertia behind = models::tool_inertia(cell.tool);
  PoseWorldConfig config;
  config.proxy = {.mass_kg = proxy_mass(cell, settings),
                  .inertia_kg_m2 = felt_inertia_kg_m2(cell, settings),
                  .damping_Ns_per_m = settings.damping_Ns_per_m,
                  .spring_N_per_m = settings.spring_N_per_m,
                  .turning_damping_Nms_per_rad = settings.rotational_damping_Nms_per_rad,
                  .turning_spring_Nm_per_rad = settings.rotational_spring_Nm_per_rad,
                  .held = settings.orientation == OrientationMode::held,
                  .period_s = settings.period_s,
                  .behind_mass_kg = behind.mass_kg,
                  .behind_centre_T_m = behind.centre_T_m,
                  .behind_inertia_T_kg_m2 = behind.about_T_kg_m2};
  config.turn = turn_sets(cell);
  config.looks_ahead = settings.looks_ahead;
  return config;
}

std::unique_ptr<PoseWorld> make_pose_world(const description::Cell& cell, scenes::CompiledScene& scene,
                                           const SessionSettings& settings) {
  return std::make_unique<PoseWorld>(scenes::compile_rigid(*scene.source, scene.source->tool->shape), scene,
                                     pose_config(cell, settings));
}

std::unique_ptr<RenderedTool> make_tool(const description::Cell& cell, scenes::CompiledScene& scene,
                                        const SessionSettings& settings) {
  if (scene.source->tool) return std::make_unique<RigidTool>(make_pose_world(cell, scene, settings));
  return std::make_unique<PointTool>(make_rendered_world(scene, settings, proxy_mass(cell, settings)),
                                     orientation_config(cell, settings), models::tool_inertia(cell.tool).about_T_kg_m2);
}

// Returns the model of the links' motion, which the passivity observer needs for a tool that turns.
std::optional<LinkMotion> make_links(const description::Cell& cell, const models::Arm& arm,
                                     const SessionSettings& settings) {
  if (settings.orientation != OrientationMode::free || settings.passivity == Passivity::off) return std::nullopt;
  const ElasticArm elastic = elastic_arm(arm, arm.start_rad(), cell);
  return LinkMotion(arm,
                    {.stiffness = elastic.stiffness,
                     .damping = elastic.damping,
                     .behind_sensor = models::tool_inertia(cell.tool),
                     .force_age_s = settings.force_age_s},
                    settings.period_s);
}

ImpedanceConfig impedance_config(const SessionSettings& settings) {
  return {.stiffness_N_per_m = settings.coupling_stiffness_N_per_m,
          .damping_Ns_per_m = settings.coupling_damping_Ns_per_m,
          .period_s = settings.period_s};
}

decltype(CycleParts::rendering) build_rendering(const description::Cell& cell, scenes::CompiledScene& scene,
                                                const models::Arm& arm, const SessionSettings& settings) {
  if (settings.scheme == Scheme::impedance) {
    return make_torque_rendering(scene, arm, cell.drives, cell.limits, impedance_config(settings));
  }
  const models::InverseKinematicsConfig steps{.max_step_rad = max_steps_rad(cell.drives, settings.period_s)};
  return AdmittanceParts{.inverse = models::InverseKinematics(arm, steps),
                         .elastic = ElasticSetpoint(arm, cell.limits.setpoint_bandwidth_Hz, settings.period_s),
                         .tool = make_tool(cell, scene, settings),
                         .links = make_links(cell, arm, settings),
                         .release = std::make_unique<Release>(settings, orientation_config(cell, settings),
                                                              cell.supervision.release_speed_m_per_s)};
}

std::optional<EnablingInput> make_enabling_input(const description::Cell& cell, const SessionSettings& settings,
                                                 const BusIndices& bus_indices) {
  if (!cell.enabling_input || settings.without_enabling_input) return std::nullopt;
  return EnablingInput(*cell.enabling_input, cell, bus_indices[index_of(cell, cell.enabling_input->bus)]);
}

// Checks the identifiers on each interface, since several of the cell's buses may share an interface. The controller
// itself uses the identifiers of NMT, SYNC and its heartbeat.
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
  for (const fieldbus::DriveSlot& slot : parts.can_drives) {
    for (const std::uint32_t id : slot.drive->used_ids()) {
      used.push_back({slot.bus, id, "drive of " + slot.drive->description().joint});
    }
  }
  for (const std::uint32_t id : parts.sensor->used_ids()) used.push_back({parts.sensor_bus, id, "force sensor"});
  if (parts.enabling) used.push_back({parts.enabling->bus(), parts.enabling->wanted_id(), "enabling input"});
  fieldbus::refuse_shared_identifiers(used, names);
}

}  // namespace

double felt_inertia_kg_m2(const description::Cell& cell, const SessionSettings& settings) {
  const double asked = settings.rotational_inertia_kg_m2;
  return asked > 0.0 ? asked : default_inertia_kg_m2 + models::tool_inertia(cell.tool).largest_kg_m2;
}

void require_felt(const description::Cell& cell, const SessionSettings& settings) {
  pose_config(cell, settings).proxy.validate();
}

std::unique_ptr<fieldbus::ForceSensor> make_sensor(const description::Cell& cell,
                                                   const description::SensorDescription& sensor) {
  return build_sensor(cell, sensor, no_port).owned;
}

// Drives in mode cst take torques, drives in all other modes take positions.
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

void require_timestep(const description::Cell& cell, const SessionSettings& settings) {
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.on_can()) (void)make_can_drive(cell, drive, settings);
  }
  orientation_config(cell, settings).validate();
}

ModbusOpener opener_of(fieldbus::ModbusPeers peers) {
  return [peers](const description::ModbusLineDescription& line, double response_timeout_s) {
    return fieldbus::open_modbus(line, response_timeout_s, peers);
  };
}

DatagramOpener opener_of(fieldbus::UdpPeers peers) {
  return [peers](const fieldbus::UdpPeer& peer) { return fieldbus::open_udp(peer, peers); };
}

CycleParts build_parts(const description::Cell& cell, const description::SensorDescription& sensor,
                       scenes::CompiledScene& scene, const SessionSettings& settings, fieldbus::CanNetwork& network,
                       const BusIndices& bus_indices, const ModbusOpener& open_line, const DatagramOpener& open_port) {
  require_scheme(cell, settings);
  Drives drives = make_drives(cell, settings, bus_indices);
  Sensor force_sensor = build_sensor(cell, sensor, open_port);
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> lines =
      modbus_lines(cell, drives.modbus, force_sensor.on_line, open_line);
  auto arm = std::make_unique<models::Arm>(cell);
  auto rendering = build_rendering(cell, scene, *arm, settings);
  std::vector<DriveBus> buses = drive_buses(drives.can);
  const std::size_t sensor_bus = index_of(cell, cell.sensor.bus);
  return CycleParts{.network = network,
                    .drives = std::move(drives.all),
                    .can_drives = std::move(drives.can),
                    .drive_buses = std::move(buses),
                    .sensor = std::move(force_sensor.owned),
                    .sensor_bus = sensor_bus < bus_indices.size() ? bus_indices[sensor_bus] : DriveOnBus::no_bus,
                    .modbus_lines = std::move(lines),
                    .arm = std::move(arm),
                    .rendering = std::move(rendering),
                    .compensation = WrenchCompensation(cell),
                    .tool = cell.tool,
                    .enabling = make_enabling_input(cell, settings, bus_indices),
                    .supervision = cell.supervision};
}

std::vector<std::uint32_t> wanted_ids(const CycleParts& parts, std::size_t bus) {
  std::vector<std::uint32_t> ids;
  for (const fieldbus::DriveSlot& slot : parts.can_drives) {
    if (slot.bus != bus) continue;
    for (const std::uint32_t id : slot.drive->wanted_ids()) ids.push_back(id);
    // Setpoints are let in, too: a received setpoint comes from another master (Fault::second_master).
    ids.push_back(fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, slot.drive->node()));
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

Identities bring_up(CycleParts& parts, const LineStarter& start_line, const fieldbus::Tell& tell) {
  refuse_shared_identifiers(parts);
  Identities lines;
  parts.sensor->start(parts.network, parts.sensor_bus);
  lines.push_back("sensor: " + parts.sensor->identity());
  for (const auto& line : parts.modbus_lines) {
    line->start_up(parts.network.now_ns());
    start_line(*line);
  }
  if (!parts.modbus_lines.empty()) parts.network.sleep_until(parts.network.now_ns() + rate_measurement_ns);
  const std::vector<fieldbus::DriveIdentity> identities =
      fieldbus::bring_up_drives(parts.network, parts.can_drives, {}, tell);
  for (std::size_t i = 0; i < identities.size(); ++i) {
    lines.push_back("drive of " + parts.can_drives[i].drive->description().joint + ": " + describe(identities[i]));
  }
  for (const auto& line : parts.modbus_lines) {
    for (fieldbus::ModbusDrive* drive : line->drives()) {
      drive->on_sync(parts.network.now_ns());
      lines.push_back(drive->describe());
    }
  }
  return lines;
}

}  // namespace proxarm::controller
