#include "controller/command_line/new_cell/cell_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>

namespace proxarm::command_line {
namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", x);
  return text;
}

// A name out of a URDF, which may have any characters: quoted where YAML would take it for something else.
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

std::string drive_text(const description::DriveDescription& d) {
  std::string text = "  - joint: " + scalar(d.joint) + "\n    bus: " + d.bus + "\n    node: " + std::to_string(d.node) +
                     "\n    profile: cia402\n    mode: csp\n";
  if (!d.eds.empty()) text += "    eds: " + scalar(d.eds) + "\n";
  const auto add = [&text](const char* indent, const char* key, double value) {
    text += std::string(indent) + key + ": " + number(value) + "\n";
  };
  const auto own = [&](const char* key, double value) { add("    ", key, value); };
  const auto simulated = [&](const char* key, double value) { add("      ", key, value); };
  own("counts_per_motor_revolution", d.counts_per_motor_revolution);
  own("gear_ratio", d.gear_ratio);
  own("direction", d.direction);
  own("offset_counts", d.offset_counts);
  text += "    range_rad: " + list(d.range_rad) + "\n";
  own("max_speed_rad_per_s", d.max_speed_rad_per_s);
  own("max_acceleration_rad_per_s2", d.max_acceleration_rad_per_s2);
  own("rotor_inertia_kg_m2", d.rotor_inertia_kg_m2);
  own("position_bandwidth_Hz", d.position_bandwidth_Hz);
  own("gear_stiffness_Nm_per_rad", d.gear_stiffness_Nm_per_rad);
  own("gear_damping_Nms_per_rad", d.gear_damping_Nms_per_rad.value_or(0.0));
  own("max_torque_Nm", d.max_torque_Nm);
  text += "    simulation:\n";
  simulated("coulomb_friction_Nm", d.simulation.coulomb_friction_Nm);
  simulated("viscous_friction_Nms_per_rad", d.simulation.viscous_friction_Nms_per_rad);
  simulated("gear_damping_Nms_per_rad", d.simulation.gear_damping_Nms_per_rad);
  simulated("max_torque_Nm", d.simulation.max_torque_Nm);
  simulated("position_gain_per_s", d.simulation.position_gain_per_s);
  simulated("velocity_bandwidth_Hz", d.simulation.velocity_bandwidth_Hz);
  simulated("velocity_feedforward", 1.0);
  simulated("acceleration_feedforward", 1.0);
  simulated("servo_rate_Hz", d.simulation.servo_rate_Hz);
  return text;
}

// In lines of a comment.
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
      "# Made by proxarm new-cell. Keys: docs/files.md. What is estimated runs in simulation; before a real arm "
      "moves,\n# put in what its data sheets say, and see docs/safety.md.\n";
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
      "\n# counts_per_motor_revolution, gear_ratio, direction and offset_counts are placeholders: the drives' manuals "
      "and\n"
      "# `proxarm calibrate` have yours. ESTIMATED by rules of thumb: rotor inertia, stiffness and damping of gears,\n"
      "# friction, and torque where the URDF doesn't say it. Of `simulation` the controller knows nothing.\ndrives:\n";
  for (const description::DriveDescription& drive : cell.drives) text += drive_text(drive);
  text += "\nsensor:\n  description: sensor.yaml\n  bus: " + cell.sensor.bus + "\n" + sensor_keys +
          "  link: " + scalar(cell.sensor.link) +
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
