#include "models/description/profile.hpp"

#include <algorithm>

#include "models/base/text.hpp"
#include "models/description/cell.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr const char* asked = " (profile: hand_guiding)";

void require_at_most(const YamlNode& limits, const char* key, double value, double most, const char* unit) {
  description::require_at_most(limits, key, value, most, "at most " + number_text(most) + " " + unit + asked);
}

void require_there(const YamlNode& node, const char* key, const char* what) {
  require_key(node, key, std::string(what) + asked);
}

void require_limits(const YamlNode& limits, const CellLimits& given) {
  require_there(limits, "max_tool_speed_m_per_s", "the tool's speed, at most 0.25 m/s");
  require_at_most(limits, "max_tool_speed_m_per_s", given.max_tool_speed_m_per_s, reduced_speed_m_per_s, "m/s");
  require_at_most(limits, "max_elbow_speed_m_per_s", given.max_elbow_speed_m_per_s, reduced_speed_m_per_s, "m/s");
  require_there(limits, "max_tool_acceleration_m_per_s2", "the tool's acceleration, at most 10 m/s²");
  require_at_most(limits, "max_tool_acceleration_m_per_s2", given.max_tool_acceleration_m_per_s2,
                  reduced_acceleration_m_per_s2, "m/s²");
  require_at_most(limits, "following_error_rad", given.following_error_rad, guided_following_error_rad, "rad");
  require_there(limits, "max_force_N", "the force above which the arm stops");
  require_there(limits, "workspace_m", "the box that the tool stays in");
}

// Refuses the reaction hold for a switch that is squeezed through. Squeezing is a reflex, not a wish to pause, so it
// must end the session.
void require_stop_when_squeezed(const YamlNode& root, const Cell& cell) {
  const auto chosen = cell.supervision.reactions.find("enabling_squeezed");
  if (chosen == cell.supervision.reactions.end() || chosen->second != "hold") return;
  throw root.map("supervision")
      .map("reactions")
      .error_at("enabling_squeezed", std::string("stop_1 or stop_0") + asked, in_quotes(chosen->second));
}

}  // namespace

void apply_hand_guiding(const YamlNode& root, Cell& cell) {
  require_there(root, "limits", "limits of speed, force and place");
  require_limits(root.map("limits"), cell.limits);
  require_there(root, "enabling_input", "an enabling switch with three positions");
  if (!cell.enabling_input->three_position) {
    throw root.map("enabling_input")
        .error_at("three_position", std::string("the contact of the third position, {panic_bit: N}") + asked,
                  "nothing");
  }
  require_stop_when_squeezed(root, cell);
  const bool torques = std::any_of(cell.drives.begin(), cell.drives.end(),
                                   [](const DriveDescription& drive) { return drive.mode == "cst"; });
  if (torques) throw root.error_at("profile", "none: drives that take torques can't hold an arm still");
  cell.profile = Profile::hand_guiding;
  cell.supervision.monitored_standstill = true;
}

}  // namespace proxarm::description
