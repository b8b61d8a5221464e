#include "models/description/drive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/base/text.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr std::string_view shared = "drive_defaults", shared_simulation = "simulation_defaults";

constexpr double motor_turn = 2.0 * std::numbers::pi;

SimulatedDrive read_simulation(const YamlNode& node) {
  SimulatedDrive s;
  s.coulomb_friction_Nm = node.number_or("coulomb_friction_Nm", s.coulomb_friction_Nm, 0.0, 1e5);
  s.viscous_friction_Nms_per_rad =
      node.number_or("viscous_friction_Nms_per_rad", s.viscous_friction_Nms_per_rad, 0.0, 1e6);
  s.gear_damping_Nms_per_rad = node.number_or("gear_damping_Nms_per_rad", s.gear_damping_Nms_per_rad, 0.0, 1e6);
  s.gear_stiffness_ratio = node.number_or("gear_stiffness_ratio", s.gear_stiffness_ratio, 0.1, 10.0);
  s.backlash_rad = node.number_or("backlash_rad", s.backlash_rad, 0.0, 0.1);
  s.gear_hysteresis_rad = node.number_or("gear_hysteresis_rad", s.gear_hysteresis_rad, 0.0, 0.1);
  if (s.gear_hysteresis_rad > 0.0 && s.backlash_rad > 0.0) {
    throw node.error_at("gear_hysteresis_rad", "0 of a gear with backlash_rad", number_text(s.gear_hysteresis_rad));
  }
  s.torque_ripple_Nm = node.number_or("torque_ripple_Nm", s.torque_ripple_Nm, 0.0, 1e5);
  s.torque_ripple_per_revolution =
      static_cast<int>(node.integer_or("torque_ripple_per_revolution", s.torque_ripple_per_revolution, 1, 1000));
  s.max_torque_Nm = node.number("max_torque_Nm", above(0.0, 1e6));
  s.gear_torque_ratio = node.number_or("gear_torque_ratio", s.gear_torque_ratio, -10.0, 10.0);
  s.gear_torque_offset_Nm = node.number_or("gear_torque_offset_Nm", s.gear_torque_offset_Nm, -1e5, 1e5);
  s.gear_torque_noise_Nm = node.number_or("gear_torque_noise_Nm", s.gear_torque_noise_Nm, 0.0, 1e4);
  s.gear_torque_hysteresis_Nm = node.number_or("gear_torque_hysteresis_Nm", s.gear_torque_hysteresis_Nm, 0.0, 1e4);
  s.brake_torque_Nm = node.number_or("brake_torque_Nm", s.brake_torque_Nm, 0.0, 1e6);
  s.brake_delay_s = node.number_or("brake_delay_s", s.brake_delay_s, 0.0, 1.0);
  s.position_gain_per_s = node.number("position_gain_per_s", above(0.0, 1e4));
  s.velocity_bandwidth_Hz = node.number("velocity_bandwidth_Hz", above(0.0, 5e3));
  s.velocity_feedforward = node.number_or("velocity_feedforward", s.velocity_feedforward, 0.0, 1.0);
  s.acceleration_feedforward = node.number_or("acceleration_feedforward", s.acceleration_feedforward, 0.0, 1.0);
  s.servo_rate_Hz = node.number_or("servo_rate_Hz", s.servo_rate_Hz, 1000.0, 1e5);
  s.stack = node.choice_or("stack", s.stack, {"strict", "latching", "lazy", "holding", "insisting"});
  if (node.has("brake_release_s")) s.brake_release_s = node.number("brake_release_s", 0.0, 30.0);
  return s;
}

// Reads `homing`, which is required for an incremental encoder and refused for an absolute encoder.
std::optional<HomingDescription> read_homing(const YamlNode& node, const DriveDescription& drive) {
  // This program can't home drives on Modbus.
  const bool incremental = (drive.on_can() ? node.choice_or("encoder", "absolute", {"absolute", "incremental"})
                                           : node.choice_or("encoder", "absolute", {"absolute"})) == "incremental";
  if (!incremental) {
    refuse_key(node, "homing", "no `homing` without encoder: incremental");
    return std::nullopt;
  }
  require_key(node, "homing", "a map: an incremental encoder has no zero until it is homed");
  const auto map = node.find_map("homing");
  HomingDescription homing;
  homing.method = static_cast<int>(map->integer("method", -128, 127));
  homing.speed_rad_per_s = map->number("speed_rad_per_s", above(0.0, drive.max_speed_rad_per_s));
  homing.slow_speed_rad_per_s = map->number("slow_speed_rad_per_s", above(0.0, homing.speed_rad_per_s));
  homing.acceleration_rad_per_s2 =
      map->number("acceleration_rad_per_s2", above(0.0, drive.max_acceleration_rad_per_s2));
  homing.angle_rad = map->number("angle_rad", drive.range_rad[0] - 1.0, drive.range_rad[1] + 1.0);
  homing.timeout_s = map->number_or("timeout_s", homing.timeout_s, 1.0, 600.0);
  return homing;
}

// Checks that the counts of the whole range fit into the 32 bits of 607Ah and 6064h.
void check_counts(const YamlNode& node, const DriveDescription& drive) {
  for (const double angle : drive.range_rad) {
    const double counts = drive.offset_counts + drive.counts_per_rad() * angle;
    if (counts < std::numeric_limits<std::int32_t>::min() || counts > std::numeric_limits<std::int32_t>::max()) {
      throw node.error_at("range_rad",
                          "angles whose counts fit 32 bits (offset_counts + angle · gear_ratio · " +
                              number_text(drive.counts_per_motor_revolution) + " / 2π)",
                          number_text(angle) + " rad = " + number_text(std::round(counts)) + " counts");
    }
  }
}

// Reads an object: "0x60C1:02", or "0x607A" for sub-index 0.
std::uint32_t read_object(const YamlNode& node, const std::string& key) {
  const std::string text = text_like(node, key,
                                     {"0x[1-9A-Fa-f][0-9A-Fa-f]{3}(:[0-9A-Fa-f]{1,2})?",
                                      "an object, index and sub-index in hexadecimal: \"0x607A\" or \"0x60C1:02\""});
  const std::int64_t index = *strict_integer(text.substr(0, 6));
  const std::int64_t sub = text.size() > 7 ? *strict_integer("0x" + text.substr(7)) : 0;
  return static_cast<std::uint32_t>(index << 8 | sub);
}

DriveObjects read_objects(const YamlNode& node) {
  DriveObjects o;
  const std::pair<const char*, std::uint32_t*> keys[] = {{"target", &o.target},
                                                         {"controlword", &o.controlword},
                                                         {"statusword", &o.statusword},
                                                         {"position", &o.position},
                                                         {"torque", &o.torque},
                                                         {"mode", &o.mode},
                                                         {"mode_display", &o.mode_display},
                                                         {"supported_modes", &o.supported_modes},
                                                         {"interpolation_value", &o.interpolation_value},
                                                         {"interpolation_index", &o.interpolation_index}};
  for (const auto& [key, object] : keys) {
    if (node.has(key)) *object = read_object(node, key);
  }
  return o;
}

std::vector<DriveFeedback> read_feedback(const YamlNode& node) {
  std::vector<DriveFeedback> feedback;
  for (const YamlNode& each : node.list("feedback", 1, 64)) {
    feedback.push_back({read_object(each, "object"), static_cast<std::uint8_t>(integer_of(each, "bits", {8, 16, 32}))});
  }
  return feedback;
}

// Reads either a torque in counts, or an angle in counts of a second encoder.
GearTorque read_gear_torque(const YamlNode& node) {
  GearTorque torque;
  torque.object = read_object(node, "object");
  torque.bits = static_cast<std::uint8_t>(integer_of_or(node, "bits", 16, {16, 32}));
  torque.Nm_per_count = node.number_or("Nm_per_count", 0.0, -1e4, 1e4);
  torque.counts_per_revolution = node.number_or("counts_per_revolution", 0.0, -4294967296.0, 4294967296.0);
  torque.delay_s = node.number_or("delay_s", 0.0, 0.0, longest_gear_torque_delay_s);
  const bool is_sensor = torque.Nm_per_count != 0.0, is_encoder = torque.counts_per_revolution != 0.0;
  if (is_sensor == is_encoder) {
    throw node.error_at("Nm_per_count", "this of a torque sensor, or counts_per_revolution of a second encoder",
                        is_sensor ? "both" : "neither");
  }
  if (is_encoder && torque.bits != 32) throw node.error_at("bits", "32 of a second encoder: its counts would run over");
  return torque;
}

// Checks that TPDO1 has room for all objects. TPDO1 begins with statusword, position and, in mode cst, the actual
// torque.
void require_room_in_tpdo(const YamlNode& node, const DriveDescription& drive) {
  int bytes = drive.mode == "cst" ? 8 : 6;
  for (const DriveFeedback& more : drive.feedback) bytes += more.bits / 8;
  if (drive.gear_torque) bytes += drive.gear_torque->bits / 8;
  const int most = drive.fd ? 64 : 8;
  if (bytes <= most) return;
  throw node.error_at(drive.gear_torque ? "gear_torque" : "feedback",
                      "at most " + std::to_string(most) + " bytes with statusword and position" +
                          (drive.fd ? "" : " (64 with fd: true)"),
                      std::to_string(bytes) + " bytes");
}

std::vector<StartUpWrite> read_writes(const YamlNode& node) {
  std::vector<StartUpWrite> writes;
  for (const YamlNode& each : node.list("write", 1, 32)) {
    const std::int64_t bits = integer_of(each, "bits", {8, 16, 32});
    const std::int64_t value =
        each.integer("value", std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::uint32_t>::max());
    const std::int64_t most = (std::int64_t{1} << bits) - 1;
    if (value > most || value < -(most / 2) - 1) {
      throw each.error_at("value", "a number of " + std::to_string(bits) + " bits", std::to_string(value));
    }
    writes.push_back({read_object(each, "object"), static_cast<std::uint8_t>(bits), static_cast<std::uint32_t>(value)});
  }
  return writes;
}

// Checks that the mode is in the feedback. If a drive shows its mode only when it is enabled, the cycle must read the
// mode.
void require_mode_in_feedback(const YamlNode& node, const DriveDescription& drive) {
  const auto is_display = [&](const DriveFeedback& more) {
    return more.object == drive.objects.mode_display && more.bits == 8;
  };
  if (std::any_of(drive.feedback.begin(), drive.feedback.end(), is_display)) return;
  throw node.error_at("mode_shown", "`feedback` with {object: \"0x6061\", bits: 8}: the cycle must see the mode");
}

BringUp read_bring_up(const YamlNode& node, const DriveDescription& drive) {
  BringUp b;
  if (node.has("enable_timeout_s")) b.enable_timeout_s = node.number("enable_timeout_s", 0.5, 60.0);
  if (!drive.on_can()) return b;
  b.start_timeout_s = node.number_or("start_timeout_s", b.start_timeout_s, 0.5, 60.0);
  b.answer_timeout_s = node.number_or("answer_timeout_s", b.answer_timeout_s, 0.02, 5.0);
  b.shows_mode_enabled = node.choice_or("mode_shown", "before", {"before", "enabled"}) == "enabled";
  if (b.shows_mode_enabled) require_mode_in_feedback(node, drive);
  const std::string stops_by =
      node.choice_or("stops_by", "heartbeat", {"heartbeat", "setpoint_timer", "life_guarding"});
  b.stops_by = stops_by == "heartbeat"        ? StopsBy::heartbeat
               : stops_by == "setpoint_timer" ? StopsBy::setpoint_timer
                                              : StopsBy::life_guarding;
  b.controlword_bits = static_cast<std::uint16_t>(node.integer_or("controlword_bits", 0, 0, 0xFFFF));
  if ((b.controlword_bits & ~free_controlword_bits) != 0) {
    throw node.error_at("controlword_bits", "bits 4 to 6, 9 and 11 to 15 (0xFA70): the others are the state machine's");
  }
  if (node.has("skip")) {
    for (const YamlNode& each : node.list("skip", 1, 32)) b.skip.push_back(read_object(each, "object"));
  }
  if (node.has("write")) b.write = read_writes(node);
  return b;
}

}  // namespace

std::vector<YamlNode> drive_nodes(const YamlNode& root) {
  const auto defaults = root.find_map(shared), simulation = root.find_map(shared_simulation);
  if (defaults) {
    refuse_key(*defaults, "joint", "no `joint`: each drive has its own");
    refuse_key(*defaults, "simulation", "no `simulation`: what it has for all drives stands in simulation_defaults");
  }
  const std::vector<YamlNode> nodes = root.list("drives", 1, 32);
  for (const YamlNode& node : nodes) {
    if (defaults) node.default_to(*defaults);
    if (simulation) node.default_to("simulation", *simulation);
  }
  return nodes;
}

SetupError of_drive(const YamlNode& entry, const SetupError& mistake) {
  SetupProblem problem = mistake.problem();
  const std::string map = problem.key.substr(0, problem.key.find('.'));
  if (map != shared && map != shared_simulation) return mistake;
  problem.advice += (problem.advice.empty() ? "" : "; ") + entry.path() + " has it from there";
  return SetupError(std::move(problem));
}

DriveDescription read_drive(const YamlNode& node) {
  DriveDescription d;
  d.joint = node.string("joint");
  d.bus = node.string("bus");
  d.profile = node.choice_or("profile", d.profile, {"cia402", "modbus"});
  d.node = static_cast<std::uint8_t>(node.integer("node", 1, d.on_can() ? 127 : 247));
  if (!d.on_can()) d.description = node.existing_file("description").string();
  // Modbus drives take positions only.
  d.mode =
      d.on_can() ? node.choice_or("mode", d.mode, {"csp", "ip", "cst"}) : node.choice_or("mode", d.mode, {"csp", "ip"});
  if (d.mode == "cst") {
    d.rated_torque_Nm = node.number("rated_torque_Nm", above(0.0, 1e5));
    d.max_torque_Nm = node.number("max_torque_Nm", above(0.0, 10.0 * d.rated_torque_Nm));
  } else {
    if (d.on_can() && node.has("rated_torque_Nm")) d.rated_torque_Nm = node.number("rated_torque_Nm", above(0.0, 1e5));
    if (node.has("max_torque_Nm")) d.max_torque_Nm = node.number("max_torque_Nm", above(0.0, 1e6));
  }
  if (d.on_can()) {
    if (node.has("eds")) d.eds = node.existing_file("eds").string();
    if (const auto objects = node.find_map("objects")) d.objects = read_objects(*objects);
    d.fd = node.boolean_or("fd", false);
    if (node.has("feedback")) d.feedback = read_feedback(node);
    if (const auto torque = node.find_map("gear_torque")) d.gear_torque = read_gear_torque(*torque);
    if (d.gear_torque && d.mode == "cst") {
      throw node.error_at("gear_torque", "none with mode: cst, which has no setpoints that could yield to it");
    }
    require_room_in_tpdo(node, d);
  }
  if (!d.on_can()) d.word_order_tried = node.boolean_or("word_order_tried", false);
  if (const auto bring_up = node.find_map("bring_up")) d.bring_up = read_bring_up(*bring_up, d);
  if (node.has("device_type")) {
    d.device_type = static_cast<std::uint32_t>(node.integer("device_type", 0, 0xffffffff));
  }
  d.counts_per_motor_revolution =
      node.number_or("counts_per_motor_revolution", d.counts_per_motor_revolution, 1.0, 4294967296.0);
  d.gear_ratio = node.number_or("gear_ratio", d.gear_ratio, above(0.0, 1e5));
  d.direction = static_cast<int>(integer_of_or(node, "direction", d.direction, {1, -1}));
  d.offset_counts = static_cast<std::int32_t>(node.integer_or(
      "offset_counts", 0, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));
  const auto range = node.numbers("range_rad", 2, 2, between(-1000.0, 1000.0));
  if (!(range[0] < range[1])) {
    throw node.error_at("range_rad", "[lowest, highest] angle, in this order",
                        "[" + number_text(range[0]) + ", " + number_text(range[1]) + "]");
  }
  d.range_rad = {range[0], range[1]};
  check_counts(node, d);
  d.max_speed_rad_per_s = node.number("max_speed_rad_per_s", above(0.0, 100.0));
  d.max_acceleration_rad_per_s2 = node.number("max_acceleration_rad_per_s2", above(0.0, 1e4));
  d.homing = read_homing(node, d);
  d.rotor_inertia_kg_m2 = node.number("rotor_inertia_kg_m2", 0.0, 1e5);
  d.position_bandwidth_Hz = node.number_or("position_bandwidth_Hz", 100.0, 1.0, 10000.0);
  d.gear_stiffness_Nm_per_rad = node.number_or("gear_stiffness_Nm_per_rad", 0.0, 0.0, 1e9);
  if (d.gear_torque && !(d.gear_stiffness_Nm_per_rad > 0.0)) {
    throw node.error_at("gear_torque",
                        "gear_stiffness_Nm_per_rad above 0 with it: the gear is damped through its give");
  }
  if (node.has("gear_damping_Nms_per_rad")) {
    d.gear_damping_Nms_per_rad = node.number("gear_damping_Nms_per_rad", 0.0, 1e6);
  }
  d.simulation = read_simulation(node.map("simulation"));
  return d;
}

double DriveDescription::counts_per_rad() const noexcept {
  return direction * counts_per_motor_revolution * gear_ratio / motor_turn;
}

double DriveDescription::angle_rad(std::int32_t counts) const noexcept {
  return (static_cast<double>(counts) - offset_counts) / counts_per_rad();
}

}  // namespace proxarm::description
