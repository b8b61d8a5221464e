#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "controller/bring_up.hpp"
#include "controller/command_line/commands.hpp"
#include "controller/command_line/data_files.hpp"
#include "controller/command_line/exit_status.hpp"
#include "models/arm.hpp"
#include "models/description/cell.hpp"
#include "models/description/dbc_file.hpp"
#include "models/description/eds_file.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "models/description/setup_error.hpp"
#include "scenes/check.hpp"
#include "scenes/explain.hpp"
#include "scenes/scene_file.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;

// What a file is, by a key that only its kind has.
enum class Kind { cell, scene, hand, sensor, registers, eds, dbc };

Kind kind_of(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".eds" || extension == ".dcf") return Kind::eds;
  if (extension == ".dbc") return Kind::dbc;
  if (fs::is_directory(file)) return Kind::scene;  // yaml-cpp loses memory on one
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (root.IsMap()) {
      if (root["drives"] || root["urdf"]) return Kind::cell;
      if (root["protocol"] && root["command"]) return Kind::registers;
      if (root["protocol"]) return Kind::sensor;
      if (root["waypoints"] || root["multisine"] || root["stiffness_N_per_m"]) return Kind::hand;
    }
  } catch (const YAML::Exception&) {  // the strict loader says what is wrong, and where
  }
  return Kind::scene;
}

// Assumption 1 for each object and the whole, with the worst figures; null if it doesn't hold.
const char* check_laws(const scenes::Scene& scene) {
  bool passed = true;
  for (const scenes::CheckReport& report : scenes::check_scene(scene)) {
    std::fputs(report.text().c_str(), stdout);
    passed = passed && report.passed();
  }
  return passed ? "scene" : nullptr;
}

// With the files that it names, and each device as the controller would make it.
void check_cell(const fs::path& file) {
  const description::Cell cell = description::load_cell(file);
  const models::Arm arm(cell);
  const std::int64_t period_ns = std::llround(1e9 * cell.default_period_s);
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.on_can()) {
      const fieldbus::ServoDrive servo(drive, {.period_ns = period_ns});
    } else {
      const fieldbus::ModbusDrive modbus(drive, description::load_modbus_drive(drive.description), period_ns);
    }
  }
  controller::make_sensor(cell, description::load_sensor(cell.sensor.description));
}

const char* check(const fs::path& file) {
  switch (kind_of(file)) {
    case Kind::cell:
      check_cell(file);
      return "cell";
    case Kind::registers:
      description::load_modbus_drive(file);
      return "register map of a Modbus drive";
    case Kind::eds:
      description::load_eds(file);
      return "description of a CANopen device";
    case Kind::dbc:
      (void)description::load_dbc(file);
      return "list of messages and signals";
    case Kind::sensor:
      description::load_sensor(file);
      return "sensor";
    case Kind::hand:
      description::load_hand(file);
      return "hand";
    case Kind::scene:
      return check_laws(scenes::load_scene(file));
  }
  return "";
}

}  // namespace

int check_command(const FileOptions& options) {
  int status = 0;
  for (const fs::path& given : options.files) {
    try {
      const char* kind = check(user_file(given));
      if (kind != nullptr) {
        std::printf("%s: fine, a %s\n", given.c_str(), kind);
      } else {
        std::fprintf(stderr, "proxarm: %s: its forces don't keep Assumption 1; the states are given above\n",
                     given.c_str());
        status = set_up_mistake;
      }
    } catch (const description::SetupError& error) {
      std::fprintf(stderr, "proxarm: %s\n", error.what());
      status = set_up_mistake;
    }
  }
  return status;
}

int explain_command(const FileOptions& options) {
  for (const fs::path& given : options.files) {
    std::printf("%s: %s", given.c_str(), scenes::explain(scenes::load_scene(user_file(given))).c_str());
  }
  return 0;
}

}  // namespace proxarm::command_line
