#include "models/description/hand.hpp"

#include <cmath>
#include <numbers>

#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr Range stiffness_range = between(0.0, 1e5), damping_range = between(0.0, 1e4);
constexpr Range place_range = between(-100.0, 100.0), force_range = between(-1e4, 1e4);

// `FILE.csv`, whose header has these names; or `{file: FILE.csv, columns: {x_m: px}}` for others.
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

// The tool begins where the trajectory does, wherever that was recorded.
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

Waypoint read_waypoint(const YamlNode& node) {
  return {.time_s = node.number("time_s", 0.0, 1e6), .offset_m = node.vec3("offset_m", between(-10.0, 10.0))};
}

Sine read_sine(const YamlNode& node) {
  Sine sine;
  sine.frequency_Hz = node.number("frequency_Hz", above(0.0, 1000.0));
  sine.amplitude_m = node.number("amplitude_m", 0.0, 1.0);
  sine.phase_rad = node.number_or("phase_rad", 0.0, -2.0 * std::numbers::pi, 2.0 * std::numbers::pi);
  sine.direction = node.vec3("direction", between(-1e3, 1e3));
  const double length = std::hypot(sine.direction[0], sine.direction[1], sine.direction[2]);
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
  root.finish();
  return hand;
}

}  // namespace proxarm::description
