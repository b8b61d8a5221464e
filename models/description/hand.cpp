#include "models/description/hand.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr Range stiffness_range = between(0.0, 1e5), damping_range = between(0.0, 1e4);
constexpr Range place_range = between(-100.0, 100.0), force_range = between(-1e4, 1e4);

// Reads a key that is either `FILE.csv`, with these columns in the file's header, or `{file: FILE.csv, columns: {x_m:
// px}}` with other column names.
std::vector<TimedVector> read_data(const YamlNode& root, const char* key, CsvColumns columns, Range range,
                                   HandDescription& hand) {
  const YamlNode node = root.at(key);
  hand.data_files.push_back(node.is_map() ? node.existing_file("file") : root.existing_file(key));
  if (const auto names = node.is_map() ? node.find_map("columns") : std::nullopt) {
    for (std::string& column : columns) {
      if (names->has(column)) column = names->string(column);
    }
  }
  return load_csv(hand.data_files.back(), columns, range);
}

// Shifts the trajectory so that it begins at zero, because the tool begins where the trajectory begins.
void begin_at_zero(std::vector<TimedVector>& trajectory) {
  const std::array<double, 3> first = trajectory.front().value;
  for (TimedVector& sample : trajectory) {
    for (std::size_t i = 0; i < 3; ++i) sample.value[i] -= first[i];
  }
}

void read_hand_data(const YamlNode& root, HandDescription& hand) {
  if (root.has("trajectory")) {
    refuse_key(root, "waypoints", "either waypoints or a trajectory", "both");
    hand.trajectory = read_data(root, "trajectory", {"time_s", "x_m", "y_m", "z_m"}, place_range, hand);
    begin_at_zero(hand.trajectory);
  }
  if (root.has("force")) hand.force = read_data(root, "force", {"time_s", "x_N", "y_N", "z_N"}, force_range, hand);
}
constexpr Range turning_range = between(0.0, 1e4);

// Checks that intended turns come with a grip on the orientation. Without this grip, the hand would silently ignore the
// turns.
void require_turning_grip(const YamlNode& root, const HandDescription& hand) {
  if (hand.twists()) return;
  const bool wanted = std::any_of(hand.waypoints.begin(), hand.waypoints.end(),
                                  [](const Waypoint& point) { return point.turn_rad != std::array<double, 3>{}; }) ||
                      std::any_of(hand.multisine.begin(), hand.multisine.end(),
                                  [](const Sine& sine) { return sine.amplitude_rad > 0.0; });
  if (!wanted) return;
  throw root.error("turn_rad or amplitude_rad",
                   "turning_stiffness_Nm_per_rad above 0, with which the hand turns the tool");
}

double length_of(const std::array<double, 3>& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

Waypoint read_waypoint(const YamlNode& node) {
  Waypoint waypoint{.time_s = node.number("time_s", 0.0, 1e6)};
  if (!node.has("turn_rad")) require_key(node, "offset_m", "offset_m, turn_rad or both");
  waypoint.offset_m = node.vec3_or("offset_m", {0, 0, 0}, between(-10.0, 10.0));
  if (node.has("turn_rad")) {
    waypoint.turn_rad = node.vec3("turn_rad", between(-3.0, 3.0));
    const double angle = length_of(waypoint.turn_rad);
    if (angle > 3.0) throw node.error_at("turn_rad", "a rotation of at most 3 rad", number_text(angle));
  }
  return waypoint;
}

Sine read_sine(const YamlNode& node) {
  Sine sine;
  sine.frequency_Hz = node.number("frequency_Hz", above(0.0, 1000.0));
  if (!node.has("amplitude_rad")) require_key(node, "amplitude_m", "amplitude_m, amplitude_rad or both");
  sine.amplitude_m = node.number_or("amplitude_m", 0.0, 0.0, 1.0);
  sine.amplitude_rad = node.number_or("amplitude_rad", 0.0, 0.0, 1.0);
  sine.phase_rad = node.number_or("phase_rad", 0.0, -2.0 * std::numbers::pi, 2.0 * std::numbers::pi);
  sine.direction = node.vec3("direction", between(-1e3, 1e3));
  const double length = length_of(sine.direction);
  if (length < 1e-3) throw node.error_at("direction", "a direction of length 0.001 or more", number_text(length));
  for (double& x : sine.direction) x /= length;
  return sine;
}

}  // namespace

Grip tightest_grip(const HandDescription& hand) noexcept {
  Grip tightest{0.0, hand.stiffness_N_per_m, hand.damping_Ns_per_m};
  for (const Grip& grip : hand.grips) {
    if (grip.stiffness_N_per_m > tightest.stiffness_N_per_m) tightest = grip;
  }
  tightest.stiffness_N_per_m *= 1.0 + hand.variation.share;
  tightest.damping_Ns_per_m *= 1.0 + hand.variation.share;
  return tightest;
}

HandDescription load_hand(const std::filesystem::path& file) { return read_hand(YamlNode::load(file)); }

HandDescription read_hand(const YamlNode& root) {
  const std::filesystem::path& file = root.file();
  HandDescription hand;
  hand.file = std::filesystem::absolute(file).lexically_normal();
  hand.name = root.string_or("name", file.stem().string());
  hand.mass_kg = root.number_or("mass_kg", hand.mass_kg, 0.0, 100.0);
  const bool follows = root.has("trajectory") || root.has("waypoints") || root.has("multisine");
  if (root.has("force") && !follows) hand.stiffness_N_per_m = hand.damping_Ns_per_m = 0.0;
  hand.stiffness_N_per_m = root.number_or("stiffness_N_per_m", hand.stiffness_N_per_m, stiffness_range);
  hand.damping_Ns_per_m = root.number_or("damping_Ns_per_m", hand.damping_Ns_per_m, damping_range);
  hand.max_force_N = root.number_or("max_force_N", hand.max_force_N, between(1.0, 1e5));
  hand.inertia_kg_m2 = root.number_or("inertia_kg_m2", hand.inertia_kg_m2, 0.0, 10.0);
  if (hand.inertia_kg_m2 > 0.0 && !(hand.mass_kg > 0.0)) {
    throw root.error_at("inertia_kg_m2", "0 of a hand without mass_kg", number_text(hand.inertia_kg_m2));
  }
  hand.turning_stiffness_Nm_per_rad =
      root.number_or("turning_stiffness_Nm_per_rad", hand.turning_stiffness_Nm_per_rad, turning_range);
  hand.turning_damping_Nms_per_rad =
      root.number_or("turning_damping_Nms_per_rad", hand.turning_damping_Nms_per_rad, turning_range);
  hand.max_torque_Nm = root.number_or("max_torque_Nm", hand.max_torque_Nm, between(0.1, 1e4));
  if (root.has("grips")) {
    for (const YamlNode& node : root.list("grips", 1, 1000)) {
      const Grip grip{node.number("time_s", 0.0, 1e6), node.number("stiffness_N_per_m", stiffness_range),
                      node.number("damping_Ns_per_m", damping_range)};
      if (!hand.grips.empty() && grip.time_s < hand.grips.back().time_s + grip_change_s) {
        throw node.error_at("time_s", "a time at least " + number_text(grip_change_s) + " s after the grip before, " +
                                          number_text(hand.grips.back().time_s) + " s");
      }
      hand.grips.push_back(grip);
    }
  }
  if (const auto map = root.find_map("variation")) {
    hand.variation.share = map->number("share", 0.0, 0.9);
    hand.variation.interval_s = map->number_or("interval_s", hand.variation.interval_s, 0.02, 1000.0);
    hand.variation.seed = static_cast<std::uint64_t>(map->integer_or("seed", 1, 0, 1'000'000'000));
  }
  if (root.has("waypoints")) {
    for (const YamlNode& node : root.list("waypoints", 1, 100'000)) {
      const Waypoint waypoint = read_waypoint(node);
      if (!hand.waypoints.empty() && waypoint.time_s <= hand.waypoints.back().time_s) {
        throw node.error_at("time_s",
                            "a time after the one before, " + number_text(hand.waypoints.back().time_s) + " s");
      }
      hand.waypoints.push_back(waypoint);
    }
  }
  if (root.has("multisine")) {
    for (const YamlNode& node : root.list("multisine", 1, 1000)) hand.multisine.push_back(read_sine(node));
  }
  read_hand_data(root, hand);
  require_turning_grip(root, hand);
  root.finish();
  return hand;
}

}  // namespace proxarm::description
