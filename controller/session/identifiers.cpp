#include "controller/session/identifiers.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/cia402/drive_identifiers.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/key_line.hpp"

namespace proxarm::controller {
namespace {

using description::Cell;
using description::SensorDescription;
using description::SetupError;

struct Use {
  std::size_t interface = 0;
  std::uint32_t id = 0;
  std::string owner;
  std::string key{};  // the key in the cell's file that chooses the identifier; empty: no key does
  std::string bus{};  // name of the cell's bus
};

constexpr std::size_t no_interface = static_cast<std::size_t>(-1);

// Returns the interface of the cell's bus; no_interface for a Modbus line.
std::size_t interface_of(const Cell& cell, const BusIndices& indices, const std::string& bus) {
  for (std::size_t i = 0; i < cell.buses.size(); ++i) {
    if (cell.buses[i].name == bus) return indices[i];
  }
  return no_interface;
}

// Returns the key that gives the sensor this identifier. If several settings have the identifier as their value, such
// as a divisor by chance, the key is "sensor.settings".
std::string sensor_key(const Cell& cell, const SensorDescription& sensor, std::uint32_t id) {
  if (!sensor.described || sensor.described->has_base_id) return "sensor.base_id";
  if (!sensor.described->has_settings) return "sensor.bus";
  const auto& settings = cell.sensor.choices.settings;
  const auto is_it = [id](const description::SensorSettingChoice& choice) { return choice.value == id; };
  if (std::count_if(settings.begin(), settings.end(), is_it) != 1) return "sensor.settings";
  return "sensor.settings." + std::find_if(settings.begin(), settings.end(), is_it)->name;
}

// Returns the key of the setting that was refused. The sensor refuses the identifiers of NMT and SYNC, but doesn't know
// which of its settings chose them.
std::string refused_key(const Cell& cell, const SensorDescription& sensor, const std::string& told) {
  if (told != "sensor.settings") return told;
  for (const std::uint32_t id : sensor.described->wire_ids(cell.sensor.base_id)) {
    if (id == 0x000 || id == fieldbus::sync_id) return sensor_key(cell, sensor, id);
  }
  return told;
}

// Returns the sensor's identifiers. A refusal by the sensor is thrown with the line of its key in the cell's file.
std::vector<std::uint32_t> sensor_identifiers(const Cell& cell, const SensorDescription& sensor) {
  try {
    return make_sensor(cell, sensor)->used_ids();
  } catch (const SetupError& error) {
    description::SetupProblem problem = error.problem();
    const bool of_cell = problem.key.starts_with("sensor.") && (problem.file.empty() || problem.file == cell.file);
    if (!of_cell || problem.line > 0) throw;
    problem.file = cell.file.string();
    problem.key = refused_key(cell, sensor, problem.key);
    problem.line = description::line_of_key(cell.file, problem.key);
    throw SetupError(problem);
  }
}

void add_controller_and_drives(const Cell& cell, const BusIndices& indices, std::vector<Use>& uses) {
  for (const description::DriveDescription& drive : cell.drives) {
    if (!drive.on_can()) continue;
    const std::size_t interface = interface_of(cell, indices, drive.bus);
    for (const std::uint32_t id :
         {0x000U, fieldbus::sync_id, fieldbus::heartbeat_id(fieldbus::DriveSettings{}.master_node)}) {
      uses.push_back({interface, id, "the controller"});
    }
    for (const std::uint32_t id : fieldbus::drive_identifiers(drive.node)) {
      uses.push_back({interface, id, "the drive of " + drive.joint});
    }
  }
}

void add_sensor(const Cell& cell, const SensorDescription& sensor, const BusIndices& indices, std::vector<Use>& uses) {
  const std::vector<std::uint32_t> ids = sensor_identifiers(cell, sensor);
  const std::size_t interface = interface_of(cell, indices, cell.sensor.bus);
  if (interface == no_interface) return;
  for (const std::uint32_t id : ids) {
    uses.push_back({interface, id, "the force sensor", sensor_key(cell, sensor, id), cell.sensor.bus});
  }
}

void add_enabling_input(const Cell& cell, const BusIndices& indices, std::vector<Use>& uses) {
  const description::EnablingInputDescription& input = *cell.enabling_input;
  const std::uint32_t flag = input.extended ? fieldbus::extended_id_flag : 0;
  Use use{interface_of(cell, indices, input.bus), input.identifier | flag, "the enabling input",
          "enabling_input.identifier", input.bus};
  const auto drive = std::find_if(cell.drives.begin(), cell.drives.end(),
                                  [&](const description::DriveDescription& d) { return d.joint == input.drive; });
  if (drive != cell.drives.end()) {
    use.id = fieldbus::pdo_id(fieldbus::PdoDirection::transmit, 2, drive->node);
    use.owner = "the enabling input of " + drive->joint;
    use.key.clear();
  }
  uses.push_back(use);
}

[[noreturn]] void refuse(const Cell& cell, const Use& chosen, const Use& other) {
  const std::uint32_t id = chosen.id & ~fieldbus::extended_id_flag;
  throw SetupError({.file = cell.file.string(),
                    .line = description::line_of_key(cell.file, chosen.key),
                    .bus = chosen.bus,
                    .key = chosen.key,
                    .found = "identifier " + fieldbus::hex_text(id, 3) + " for " + chosen.owner,
                    .expected = "one that nobody else has on this bus: " + other.owner + " has it",
                    .advice = "taken are 0x000, 0x080 and 0x77F by the controller, and by each drive 0x080, 0x180, "
                              "0x200, 0x580, 0x600 and 0x700 plus its node"});
}

}  // namespace

void require_own_identifiers(const Cell& cell, const SensorDescription& sensor, const SessionSettings& settings,
                             const BusIndices& bus_indices) {
  std::vector<Use> uses;
  add_controller_and_drives(cell, bus_indices, uses);
  if (cell.enabling_input && !settings.without_enabling_input) add_enabling_input(cell, bus_indices, uses);
  add_sensor(cell, sensor, bus_indices, uses);
  // Uses that a key of the cell chooses come last in `uses`. The error names this key.
  for (std::size_t b = 0; b < uses.size(); ++b) {
    for (std::size_t a = 0; a < b && !uses[b].key.empty(); ++a) {
      const bool same = uses[a].interface == uses[b].interface && uses[a].id == uses[b].id;
      if (same && uses[a].owner != uses[b].owner) refuse(cell, uses[b], uses[a]);
    }
  }
}

}  // namespace proxarm::controller
