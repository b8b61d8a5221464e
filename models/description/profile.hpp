// `profile: hand_guiding`: what a cell must say when a person stands beside the arm and leads it by hand.
//
//   speeds         limits.max_tool_speed_m_per_s and max_elbow_speed_m_per_s at most 0.25: ISO 10218-1's reduced speed
//
//   acceleration   limits.max_tool_acceleration_m_per_s2 at most 10: ours, in proportion to the default's 20 at 0.5 m/s
//
//   deviations     limits.following_error_rad at most 5 mrad: ours; beyond it drives and standstill are judged
//
//   must be there  limits.max_force_N, limits.workspace_m, enabling_input with three_position, drives that hold a place
//
// and what it switches on: supervision.monitored_standstill. It makes no cell safe, and certifies nothing.
#pragma once

namespace proxarm::description {

class YamlNode;
struct Cell;

inline constexpr double reduced_speed_m_per_s = 0.25;
inline constexpr double reduced_acceleration_m_per_s2 = 10.0;
inline constexpr double guided_following_error_rad = 5e-3;  // 5 mm at a metre, before anything counts as moving

// `root` is the cell's file, of which all but the profile has been read. Throws SetupError where the cell isn't so.
void apply_hand_guiding(const YamlNode& root, Cell& cell);

}  // namespace proxarm::description
