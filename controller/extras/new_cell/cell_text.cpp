#include "controller/extras/new_cell/cell_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <utility>
#include <vector>

namespace proxarm::command_line {
namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", x);
  // Some readers of YAML, such as PyYAML, take 5e-05 for a text.
  std::string number = text;
  const std::size_t exponent = number.find('e');
  if (exponent != std::string::npos && number.find('.') == std::string::npos) number.insert(exponent, ".0");
  return number;
}

// Returns a name from a URDF as a YAML scalar. Such a name may have any characters, so it is quoted if YAML could
// misread it.
std::string scalar(const std::string& text) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  };
  const bool letter = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
  if ((letter || text.starts_with('/')) && std::all_of(text.begin(), text.end(), plain)) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

template <typename Numbers>
std::string list(const Numbers& numbers) {
  std::string text = "[";
  for (const double x : numbers) text += (text.size() > 1 ? ", " : "") + number(x);
  return text + "]";
}

std::string pose(const description::PoseDescription& X) {
  return "{position_m: " + list(X.position_m) + ", rpy_rad: " + list(X.rpy_rad) + "}";
}

using Keys = std::vector<std::pair<std::string, std::string>>;

// These two functions return the keys of a drive, and of its `simulation` map, that the drives of a cell usually have
// in common.
Keys common_keys(const description::DriveDescription& d) {
  Keys keys{{"profile", "cia402"}, {"mode", "csp"}};
  if (!d.eds.empty()) keys.emplace_back("eds", scalar(d.eds));
  keys.insert(keys.end(), {{"counts_per_motor_revolution", number(d.counts_per_motor_revolution)},
                           {"gear_ratio", number(d.gear_ratio)},
                           {"direction", number(d.direction)},
                           {"offset_counts", number(d.offset_counts)},
                           {"position_bandwidth_Hz", number(d.position_bandwidth_Hz)}});
  return keys;
}

Keys common_keys(const description::SimulatedDrive& s) {
  return {{"position_gain_per_s", number(s.position_gain_per_s)},
          {"velocity_bandwidth_Hz", number(s.velocity_bandwidth_Hz)},
          {"velocity_feedforward", number(s.velocity_feedforward)},
          {"acceleration_feedforward", number(s.acceleration_feedforward)},
          {"servo_rate_Hz", number(s.servo_rate_Hz)}};
}

// Returns those keys of the first drive that all other drives have with the same value. `of` returns a drive's keys.
template <class Of>
Keys shared(const std::vector<description::DriveDescription>& drives, Of of) {
  Keys all = of(drives.front());
  for (const description::DriveDescription& drive : drives) {
    const Keys its = of(drive);
    std::erase_if(all, [&](const auto& key) { return std::find(its.begin(), its.end(), key) == its.end(); });
  }
  return all;
}

Keys without(Keys keys, const Keys& others) {
  std::erase_if(keys, [&](const auto& key) { return std::find(others.begin(), others.end(), key) != others.end(); });
  return keys;
}

std::string in_braces(const Keys& keys) {
  std::string text;
  for (const auto& [key, value] : keys) text += (text.empty() ? "" : ", ") + key + ": " + value;
  return text;
}

std::string in_lines(const std::string& name, const Keys& keys) {
  std::string text = keys.empty() ? "" : name + ":\n";
  for (const auto& [key, value] : keys) text += "  " + key + ": " + value + "\n";
  return text;
}

// Returns a drive's lines: its joint, bus and node; the keys in `own`, which differ from the other drives; range; gear;
// simulation.
std::string drive_text(const description::DriveDescription& d, const Keys& own, const Keys& simulated) {
  const Keys who{{"joint", scalar(d.joint)}, {"bus", d.bus}, {"node", std::to_string(d.node)}};
  const Keys range{{"range_rad", list(d.range_rad)},
                   {"max_speed_rad_per_s", number(d.max_speed_rad_per_s)},
                   {"max_acceleration_rad_per_s2", number(d.max_acceleration_rad_per_s2)},
                   {"max_torque_Nm", number(d.max_torque_Nm)}};
  const Keys gear{{"rotor_inertia_kg_m2", number(d.rotor_inertia_kg_m2)},
                  {"gear_stiffness_Nm_per_rad", number(d.gear_stiffness_Nm_per_rad)},
                  {"gear_damping_Nms_per_rad", number(d.gear_damping_Nms_per_rad.value_or(0.0))}};
  Keys simulation{{"coulomb_friction_Nm", number(d.simulation.coulomb_friction_Nm)},
                  {"viscous_friction_Nms_per_rad", number(d.simulation.viscous_friction_Nms_per_rad)},
                  {"gear_damping_Nms_per_rad", number(d.simulation.gear_damping_Nms_per_rad)},
                  {"max_torque_Nm", number(d.simulation.max_torque_Nm)}};
  simulation.insert(simulation.end(), simulated.begin(), simulated.end());
  const std::string next = ",\n     ";
  return "  - {" + in_braces(who) + (own.empty() ? "" : next + in_braces(own)) + next + in_braces(range) + next +
         in_braces(gear) + next + "simulation: {" + in_braces(simulation) + "}}\n";
}

std::string drives_text(const std::vector<description::DriveDescription>& drives) {
  const auto of_drive = [](const description::DriveDescription& d) { return common_keys(d); };
  const auto of_simulation = [](const description::DriveDescription& d) { return common_keys(d.simulation); };
  const Keys all = shared(drives, of_drive), all_simulated = shared(drives, of_simulation);
  std::string text = in_lines("drive_defaults", all) + in_lines("simulation_defaults", all_simulated) + "drives:\n";
  for (const description::DriveDescription& d : drives) {
    text += drive_text(d, without(of_drive(d), all), without(of_simulation(d), all_simulated));
  }
  return text;
}

std::string commented(const std::string& text) {
  constexpr std::size_t width = 116;
  std::string out, line = "#";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    if (line.size() + 1 + end - at > width) {
      out += line + "\n";
      line = "#  ";
    }
    line += " " + text.substr(at, end - at);
    at = end + 1;
  }
  return out + line + "\n";
}

}  // namespace

std::string cell_text(const description::Cell& cell, const std::vector<std::string>& remarks, bool with_scene,
                      const std::string& sensor_keys) {
  std::string text =
      "# Made by proxarm new-cell. Keys: docs/reference/files.md. What is estimated runs in simulation; before a real "
      "arm "
      "moves,\n# put in what its data sheets say, and see docs/explanation/safety.md.\n";
  for (const std::string& remark : remarks) text += commented("- " + remark);
  text += "name: " + scalar(cell.name) +
          "\nurdf: arm.urdf\n\n# Where the base is in the world, and which way is down.\nbase_W: " + pose(cell.base_W) +
          "\ngravity_W_m_per_s2: " + list(cell.gravity_W_m_per_s2) +
          "\n# Found: away from singularities and ends of ranges, with room for the hand's way.\nstart_rad: " +
          list(cell.start_rad) +
          "\n\n# All that hangs after the sensor: measure yours.\ntool:\n  mass_kg: " + number(cell.tool.mass_kg) +
          "\n  centre_of_mass_S_m: " + list(cell.tool.centre_of_mass_S_m) +
          "\n  inertia_kg_m2: " + list(cell.tool.inertia_kg_m2) + "\n  handle_S: " + pose(cell.tool.handle_S) +
          "\n\nbuses:\n";
  for (const description::BusDescription& bus : cell.buses) {
    text += "  - {name: " + bus.name + ", bitrate: " + std::to_string(bus.bitrate) + "}\n";
  }
  text +=
      "\n# What all drives have; a drive's own keys go first. counts_per_motor_revolution, gear_ratio, direction and\n"
      "# offset_counts are placeholders: the drives' manuals and `proxarm calibrate` have yours. ESTIMATED by rules "
      "of\n"
      "# thumb: rotor inertia, gears, friction, and torque where the URDF doesn't say it. `simulation` is for that "
      "alone.\n" +
      drives_text(cell.drives);
  text += "\nsensor:\n  description: sensor.yaml\n" +
          (cell.sensor.on_udp()
               ? "  host: " + cell.sensor.host + "  # of the simulated sensor; a real one has its own address\n"
               : "  bus: " + cell.sensor.bus + "\n") +
          sensor_keys + "  link: " + scalar(cell.sensor.link) +
          "\n  # z of the sensor points out of the arm, along its last joint's axis.\n  pose_link: " +
          pose(cell.sensor.pose_link) + "\n  noise_N: 0.02\n  noise_Nm: 0.001\n";
  text += "\nlimits:\n  max_tool_speed_m_per_s: 0.5\n  max_tool_acceleration_m_per_s2: 20\n  max_force_N: " +
          number(cell.limits.max_force_N) +
          "  # what its joints bear in their worst pose, 60 to 200\n  leash_m: 0.02\n  setpoint_bandwidth_Hz: " +
          number(cell.limits.setpoint_bandwidth_Hz) + "\n\nreceive_window: " + number(cell.receive_window) +
          "  # of the timestep, until which the sensor's and the drives' frames are taken\ndefault_period_s: " +
          number(cell.default_period_s) +
          "\n# A quarter more than the least mass that is stable with margins and steady on the simulated arm (tune).\n"
          "default_mass_kg: " +
          number(cell.default_mass_kg) + "\n";
  if (cell.default_damping_Ns_per_m > 0.0) {
    text += "# With it the mass is stable; without, a larger one would be.\ndefault_damping_Ns_per_m: " +
            number(cell.default_damping_Ns_per_m) + "\n";
  }
  if (with_scene) text += "default_scene: scene.yaml\n";
  if (!cell.default_hand.empty()) text += "default_hand: hand.yaml\n";
  return text;
}

}  // namespace proxarm::command_line
