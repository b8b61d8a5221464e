#include "models/description/cell.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/base/text.hpp"
#include "models/description/drive.hpp"
#include "models/description/profile.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

PoseDescription read_pose(const YamlNode& node) {
  return {.position_m = node.vec3_or("position_m", {}, between(-1000.0, 1000.0)),
          .rpy_rad = node.vec3_or("rpy_rad", {}, between(-turn, turn))};
}

PoseDescription pose_or_identity(const YamlNode& node, std::string_view key) {
  const auto pose = node.find_map(key);
  return pose ? read_pose(*pose) : PoseDescription{};
}

// Returns the path of a scene or a hand, or an empty string. Doesn't check that the file exists, because a run may use
// another file.
std::string absolute_path_or_empty(const YamlNode& node, std::string_view key) {
  return node.has(key) ? node.path_of(key).string() : std::string();
}

// Reads a name that is used on the command line (--bus NAME=IFACE,…), in files and in messages.
std::string read_name(const YamlNode& node, std::string_view key) {
  return text_like(node, key, {"[A-Za-z0-9_.-]{1,64}", "a name of letters, digits, _, - and . (at most 64)"});
}

// Whether an inertia is physical: positive semidefinite, with principal moments λ that satisfy the triangle inequality.
// The test is that the pseudo-inertia tr(I)/2·E − I is positive semidefinite, for these reasons:
// 1. The eigenvalues of the pseudo-inertia are tr(I)/2 − λ_i = (λ_j + λ_k − λ_i)/2. So the test is the triangle
//    inequality.
// 2. The three triangle inequalities together make each λ ≥ 0, so the inertia is positive semidefinite.
bool is_physical(const std::array<double, 6>& inertia) {
  const auto [xx, yy, zz, xy, xz, yz] = inertia;
  const double half = 0.5 * (xx + yy + zz);
  const double a = half - xx, b = half - yy, c = half - zz, d = -xy, e = -xz, f = -yz;
  // The slack allows values that are rounded to four digits and are on the boundary, such as a flat plate's inertia.
  const double slack = 1e-4 * half;
  const double A = a + slack, B = b + slack, C = c + slack;
  return half >= 0.0 && A >= 0.0 && B >= 0.0 && C >= 0.0 && A * B - d * d >= 0.0 && A * C - e * e >= 0.0 &&
         B * C - f * f >= 0.0 && A * (B * C - f * f) - d * (d * C - f * e) + e * (d * f - B * e) >= 0.0;
}

ToolDescription read_tool(const YamlNode& node) {
  ToolDescription tool;
  tool.mass_kg = node.number("mass_kg", 0.0, 1000.0);
  tool.centre_of_mass_S_m = node.vec3("centre_of_mass_S_m", between(-10.0, 10.0));
  if (node.has("inertia_kg_m2")) {
    const auto inertia = node.numbers("inertia_kg_m2", 6, 6, between(-1e3, 1e3));
    std::copy(inertia.begin(), inertia.end(), tool.inertia_kg_m2.begin());
    if (!is_physical(tool.inertia_kg_m2)) {
      throw node.error_at("inertia_kg_m2",
                          "a physical inertia (ixx iyy izz ixy ixz iyz): no principal moment above the sum "
                          "of the other two");
    }
  }
  tool.handle_S = read_pose(node.map("handle_S"));
  if (node.has("shape")) tool.shape = node.existing_file("shape").string();
  return tool;
}

BusDescription read_bus(const YamlNode& node) {
  BusDescription bus;
  bus.name = read_name(node, "name");
  bus.bitrate = integer_of_or(node, "bitrate", bus.bitrate,
                              {10'000, 20'000, 50'000, 100'000, 125'000, 250'000, 500'000, 800'000, 1'000'000});
  bus.data_bitrate = node.integer_or("data_bitrate", 0, 0, 8'000'000);
  if (bus.data_bitrate != 0 && bus.data_bitrate < bus.bitrate) {
    throw node.error_at("data_bitrate", "0 (a classic bus), or at least the bitrate, " + std::to_string(bus.bitrate));
  }
  return bus;
}

// Reads a numeric IPv4 address.
std::string read_address(const YamlNode& node, std::string_view key) {
  return text_like(
      node, key,
      {R"(((25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])(\.(?!$)|$)){4})", "a numeric address, such as 192.168.0.10"});
}

// Reads the address of one device. Addresses of no device (0.x.x.x, and from 224.x.x.x on multicast and broadcast) are
// refused.
std::string read_host(const YamlNode& node) {
  std::string host = read_address(node, "host");
  const int first = std::stoi(host);
  if (first == 0 || first >= 224) throw node.error_at("host", "the address of one device", in_quotes(host));
  return host;
}

ModbusLineDescription read_modbus_line(const YamlNode& node) {
  ModbusLineDescription line;
  line.name = read_name(node, "name");
  const std::string where = exactly_one(
      node, {"host", "device"}, "either host (and port) of a TCP connection, or device (and baud) of a serial line");
  if (where == "host") {
    line.host = read_address(node, "host");
    line.port = static_cast<int>(node.integer_or("port", line.port, 1, 65535));
    return line;
  }
  line.device = node.string("device");
  line.baud = static_cast<int>(node.integer_or("baud", line.baud, 1200, 4'000'000));
  line.parity = node.choice_or("parity", line.parity, {"none", "even", "odd"});
  line.stop_bits = static_cast<int>(node.integer_or("stop_bits", line.stop_bits, 1, 2));
  line.echo = node.boolean_or("echo", false);
  return line;
}

// Lowest bandwidth of a filter (0: no filter). A control loop couldn't tolerate the delay of a slower filter, and
// finding the filter's eigenvalues would take long.
constexpr double least_bandwidth_Hz = 5.0;

double bandwidth_or(const YamlNode& node, std::string_view key, double otherwise, double max_Hz) {
  return number_or_zero(node, key, otherwise, between(least_bandwidth_Hz, max_Hz), "no filter");
}

SensorChoices read_choices(const YamlNode& node) {
  SensorChoices choices;
  choices.file = node.file();
  if (const auto settings = node.find_map("settings")) {
    for (const std::string& name : settings->keys()) {
      choices.settings.push_back({name, settings->integer(name, 0, 0xFFFFFFFF), settings->at(name).line()});
    }
  }
  if (node.has("force_range_N")) choices.force_range_N = node.vec3("force_range_N", above(0.0, 1e6));
  if (node.has("torque_range_Nm")) choices.torque_range_Nm = node.vec3("torque_range_Nm", above(0.0, 1e6));
  return choices;
}

SensorPlacement read_sensor(const YamlNode& node) {
  SensorPlacement s;
  s.description = node.existing_file("description").string();
  if (exactly_one(node, {"bus", "host"}, "either bus, or host (and port) of a sensor on UDP") == "host") {
    s.host = read_host(node);
    s.port = static_cast<int>(node.integer_or("port", 0, 1, 65535));
  } else {
    s.bus = node.string("bus");
  }
  s.base_id = static_cast<std::uint32_t>(node.integer_or("base_id", 0, 0, 0x1fffffff));
  s.choices = read_choices(node);
  s.link = node.string("link");
  s.pose_link = pose_or_identity(node, "pose_link");
  s.noise_N = node.number_or("noise_N", 0.0, 0.0, 1e3);
  s.noise_Nm = node.number_or("noise_Nm", 0.0, 0.0, 1e3);
  s.sample_rate_Hz = node.number("sample_rate_Hz", above(0.0, 1e6));
  s.bandwidth_Hz = bandwidth_or(node, "bandwidth_Hz", 0.0, 1e6);
  s.delay_s = node.number_or("delay_s", 0.0, 0.0, longest_sensor_delay_s);
  if (node.has("zero_drift_N")) s.zero_drift_N = node.number("zero_drift_N", above(0.0, 1e6));
  return s;
}

BoxDescription read_box(const YamlNode& node) {
  BoxDescription box{node.vec3("min"), node.vec3("max")};
  for (std::size_t i = 0; i < 3; ++i) {
    if (box.min_m[i] < box.max_m[i]) continue;
    (void)node.at("max").as_vec3(above(box.min_m[i], 1e6));  // throws the error that names the line
  }
  return box;
}

// Reads a vector and returns it scaled to length one.
std::array<double, 3> read_direction(const YamlNode& node, const char* key, const std::array<double, 3>& otherwise) {
  std::array<double, 3> way = node.vec3_or(key, otherwise, between(-1e3, 1e3));
  const double length = std::hypot(way[0], way[1], way[2]);
  if (!(length >= 1e-3)) throw node.error_at(key, "a direction: three numbers that aren't all next to 0");
  for (double& part : way) part /= length;
  return way;
}

CellLimits read_limits(const YamlNode& node) {
  CellLimits limits;
  limits.max_tool_speed_m_per_s =
      node.number_or("max_tool_speed_m_per_s", limits.max_tool_speed_m_per_s, above(0.0, 10.0));
  limits.max_elbow_speed_m_per_s =
      node.number_or("max_elbow_speed_m_per_s", limits.max_tool_speed_m_per_s, above(0.0, 10.0));
  limits.max_tool_acceleration_m_per_s2 =
      node.number_or("max_tool_acceleration_m_per_s2", limits.max_tool_acceleration_m_per_s2, above(0.0, 1000.0));
  limits.max_turning_speed_rad_per_s =
      node.number_or("max_turning_speed_rad_per_s", limits.max_turning_speed_rad_per_s, above(0.0, 20.0));
  // The largest angle is smaller than π by more than the motion of a step, so that no step can jump past the limit.
  limits.max_turn_rad = node.number_or("max_turn_rad", limits.max_turn_rad, 0.0, 3.0);
  if (node.has("max_tilt_rad")) limits.max_tilt_rad = node.number("max_tilt_rad", 0.0, 3.0);
  if (node.has("max_twist_rad")) limits.max_twist_rad = node.number("max_twist_rad", 0.0, 3.0);
  limits.tilt_axis = read_direction(node, "tilt_axis", limits.tilt_axis);
  if (node.has("tilt_axis") && !limits.max_tilt_rad && !limits.max_twist_rad) {
    throw node.error_at("tilt_axis", "max_tilt_rad or max_twist_rad beside it");
  }
  limits.max_force_N = node.number_or("max_force_N", limits.max_force_N, above(0.0, 1e5));
  limits.max_power_W = node.number_or("max_power_W", limits.max_power_W, 0.0, 1e5);
  limits.following_error_rad = node.number_or("following_error_rad", limits.following_error_rad, above(0.0, 1.0));
  if (const auto box = node.find_map("workspace_m")) {
    const BoxDescription workspace = read_box(*box);
    limits.workspace_min_m = workspace.min_m;
    limits.workspace_max_m = workspace.max_m;
  }
  if (node.has("keep_out_m")) {
    for (const YamlNode& zone : node.list("keep_out_m", 1, 16)) limits.keep_out.push_back(read_box(zone));
  }
  limits.leash_m = node.number_or("leash_m", limits.leash_m, above(0.0, 1.0));
  limits.setpoint_bandwidth_Hz = bandwidth_or(node, "setpoint_bandwidth_Hz", limits.setpoint_bandwidth_Hz, 500.0);
  return limits;
}

void check_bus(const YamlNode& node, const std::string& bus, const std::vector<BusDescription>& buses) {
  std::vector<std::string> names;
  for (const BusDescription& b : buses) names.push_back(b.name);
  if (names.empty()) throw node.error_at("bus", "a bus of this cell: it has no buses");
  if (std::find(names.begin(), names.end(), bus) != names.end()) return;
  const std::string meant = nearest(bus, names);
  throw node.error_at("bus", "a bus of this cell: " + one_of(names), {},
                      meant.empty() ? "" : "did you mean " + in_quotes(meant) + "?");
}

// Reads the CAN buses. The list may be empty, because all drives and the sensor may be on Modbus lines.
void read_buses(const YamlNode& root, Cell& cell) {
  for (const YamlNode& node : root.list("buses", 0, 16)) {
    const BusDescription bus = read_bus(node);
    for (const BusDescription& other : cell.buses) {
      if (other.name == bus.name) throw node.error_at("name", "a name that no other bus of this cell has");
    }
    cell.buses.push_back(bus);
  }
}

void read_modbus_lines(const YamlNode& root, Cell& cell) {
  if (!root.has("modbus_lines")) return;
  for (const YamlNode& node : root.list("modbus_lines", 0, 16)) {
    const ModbusLineDescription line = read_modbus_line(node);
    const auto has_name = [&](const auto& other) { return other.name == line.name; };
    if (std::any_of(cell.buses.begin(), cell.buses.end(), has_name) ||
        std::any_of(cell.modbus_lines.begin(), cell.modbus_lines.end(), has_name)) {
      throw node.error_at("name", "a name that no other bus or line of this cell has");
    }
    cell.modbus_lines.push_back(line);
  }
}

void check_line(const YamlNode& node, const std::string& line, const std::vector<ModbusLineDescription>& lines) {
  std::vector<std::string> names;
  for (const ModbusLineDescription& l : lines) names.push_back(l.name);
  if (std::find(names.begin(), names.end(), line) != names.end()) return;
  throw node.error_at("bus", names.empty() ? "a line of this cell: it has no modbus_lines"
                                           : "one of this cell's modbus_lines: " + one_of(names));
}

// Checks that drive and bus agree on CAN FD, because a drive for classic CAN answers every FD frame with an error
// frame.
void check_format(const YamlNode& node, const DriveDescription& drive, const std::vector<BusDescription>& buses) {
  const auto bus =
      std::find_if(buses.begin(), buses.end(), [&](const BusDescription& b) { return b.name == drive.bus; });
  if (drive.fd && bus->data_bitrate == 0) {
    throw node.error_at("fd", "false: bus " + drive.bus + " is classic CAN, it has no data_bitrate", "true");
  }
  if (!drive.fd && bus->data_bitrate != 0) {
    throw node.error_at("bus", "a classic bus, or fd: true at this drive", in_quotes(drive.bus),
                        "the drive of " + drive.joint +
                            " is classic CAN but the bus carries CAN FD: it would answer "
                            "every FD frame with an error frame");
  }
}

DriveDescription read_drive_of(const YamlNode& node, const Cell& cell) {
  DriveDescription drive = read_drive(node);
  if (drive.on_can()) {
    check_bus(node, drive.bus, cell.buses);
    check_format(node, drive, cell.buses);
  } else {
    check_line(node, drive.bus, cell.modbus_lines);
  }
  for (const DriveDescription& other : cell.drives) {
    if (other.joint == drive.joint) throw node.error_at("joint", "a joint that no other drive of this cell moves");
    if (other.bus == drive.bus && other.node == drive.node) {
      throw node.error_at("node", "a node that is free on bus " + drive.bus, {},
                          "joint " + in_quotes(other.joint) + " has it already");
    }
  }
  return drive;
}

void read_drives(const YamlNode& root, Cell& cell) {
  for (const YamlNode& node : drive_nodes(root)) {
    try {
      cell.drives.push_back(read_drive_of(node, cell));
    } catch (const SetupError& mistake) {
      throw of_drive(node, mistake);
    }
  }
}

void read_start(const YamlNode& root, Cell& cell) {
  const YamlNode node = root.at("start_rad");
  const std::size_t n = cell.drives.size();
  cell.start_rad = node.as_numbers(n, n);
  const auto elements = node.as_list();
  for (std::size_t i = 0; i < n; ++i) {
    const auto [low, high] = cell.drives[i].range_rad;
    if (cell.start_rad[i] < low || cell.start_rad[i] > high) {
      throw elements[i].error("an angle in the range of joint " + in_quotes(cell.drives[i].joint) + ", " +
                              number_text(low) + " to " + number_text(high) + " rad");
    }
  }
}

// Reads the enabling input. Its drive must be on CAN; the bus of the input is the bus of this drive.
EnablingInputDescription read_enabling(const YamlNode& node, const Cell& cell) {
  EnablingInputDescription input = read_enabling_input(node);
  if (input.drive.empty()) {
    check_bus(node, input.bus, cell.buses);
    return input;
  }
  const auto found = std::find_if(cell.drives.begin(), cell.drives.end(),
                                  [&](const DriveDescription& drive) { return drive.joint == input.drive; });
  if (found == cell.drives.end()) throw node.error_at("drive", "the joint of one of this cell's drives");
  if (!found->on_can()) throw node.error_at("drive", "a drive on CAN: a Modbus drive's inputs aren't read");
  input.bus = found->bus;
  return input;
}

}  // namespace

Cell load_cell(const std::filesystem::path& file) { return read_cell(YamlNode::load(file)); }

Cell read_cell(const YamlNode& root) {
  const std::filesystem::path& file = root.file();
  Cell cell;
  cell.file = std::filesystem::absolute(file).lexically_normal();
  cell.name = root.string_or("name", file.stem().string());
  cell.urdf = root.existing_file("urdf");
  cell.base_W = pose_or_identity(root, "base_W");
  cell.gravity_W_m_per_s2 = root.vec3_or("gravity_W_m_per_s2", cell.gravity_W_m_per_s2, between(-30.0, 30.0));
  cell.tool = read_tool(root.map("tool"));
  read_buses(root, cell);
  read_modbus_lines(root, cell);
  read_drives(root, cell);
  read_start(root, cell);
  cell.sensor = read_sensor(root.map("sensor"));
  const bool on_line = std::any_of(cell.modbus_lines.begin(), cell.modbus_lines.end(),
                                   [&](const ModbusLineDescription& line) { return line.name == cell.sensor.bus; });
  if (!on_line && !cell.sensor.on_udp()) check_bus(root.map("sensor"), cell.sensor.bus, cell.buses);
  if (const auto limits = root.find_map("limits")) cell.limits = read_limits(*limits);
  const bool torques = std::any_of(cell.drives.begin(), cell.drives.end(),
                                   [](const DriveDescription& drive) { return drive.mode == "cst"; });
  cell.passivity = root.choice_or("passivity", torques ? "off" : "auto", {"off", "observe", "auto", "on"});
  if (torques && cell.passivity != "off") {
    throw root.error_at("passivity",
                        "off: drives that take torques (mode: cst) have no proxy with a mass to be damped");
  }
  if (const auto supervision = root.find_map("supervision")) cell.supervision = read_supervision(*supervision);
  if (const auto input = root.find_map("enabling_input")) cell.enabling_input = read_enabling(*input, cell);
  if (root.choice_or("profile", "none", {"none", "hand_guiding"}) == "hand_guiding") apply_hand_guiding(root, cell);
  cell.receive_window = root.number_or("receive_window", cell.receive_window, 0.2, 0.8);
  cell.default_period_s = root.number_or("default_period_s", cell.default_period_s, 1e-4, 0.1);
  cell.default_mass_kg = root.number_or("default_mass_kg", cell.default_mass_kg, above(0.0, 1000.0));
  cell.default_damping_Ns_per_m = root.number_or("default_damping_Ns_per_m", cell.default_damping_Ns_per_m, 0.0, 1e4);
  cell.default_scene = absolute_path_or_empty(root, "default_scene");
  cell.default_hand = absolute_path_or_empty(root, "default_hand");
  root.finish();
  return cell;
}

void require_default_file(const Cell& cell, const char* key, const std::filesystem::path& path) {
  std::error_code unknown;
  if (std::filesystem::is_regular_file(path, unknown)) return;
  throw SetupError({.file = cell.file.string(),
                    .key = key,
                    .found = in_quotes(path.string(), 200) + ", which isn't there",
                    .expected = "a readable file"});
}

}  // namespace proxarm::description
