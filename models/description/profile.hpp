// Checks `profile: hand_guiding`: what a cell must state if a person stands beside the arm and leads it by hand.
//
//   speeds         limits.max_tool_speed_m_per_s and max_elbow_speed_m_per_s at most 0.25, the reduced speed of
//                  ISO 10218-1
//   acceleration   limits.max_tool_acceleration_m_per_s2 at most 10. This is our choice: half of the default, for half
//                  of the default speed
//   deviations     limits.following_error_rad at most 5 mrad. This is our choice: larger deviations count as motion
//   required keys  limits.max_force_N, limits.workspace_m, enabling_input with three_position
//   drives         no mode: cst, because drives that take torques can't hold the arm at rest
//
// The profile also switches supervision.monitored_standstill on. The profile doesn't make a cell safe and certifies
// nothing.
#pragma once

namespace proxarm::description {

class YamlNode;
struct Cell;

inline constexpr double reduced_speed_m_per_s = 0.25;
inline constexpr double reduced_acceleration_m_per_s2 = 10.0;
inline constexpr double guided_following_error_rad = 5e-3;  // 5 mm at a distance of one metre

// Applies the profile to `cell`. `root` is the cell's file, of which everything but the profile has been read. Throws
// SetupError if the cell doesn't comply.
void apply_hand_guiding(const YamlNode& root, Cell& cell);

}  // namespace proxarm::description
