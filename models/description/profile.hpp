// `profile: hand_guiding`: what a cell must say when a person stands beside the arm and leads it by hand.
//
//   limits.max_tool_speed_m_per_s, max_elbow_speed_m_per_s   at most 0.25: "reduced speed" of ISO 10218-1
//   limits.max_tool_acceleration_m_per_s2                    at most 10: our own, in proportion to the default's 20 at
//   0.5 m/s limits.max_force_N, limits.workspace_m                   must be there enabling_input, with three_position
//   must be there drives                                                   take positions
// and what it switches on: supervision.monitored_standstill. It makes no cell safe, and certifies nothing.
#pragma once

namespace proxarm::description {

class YamlNode;
struct Cell;

inline constexpr double reduced_speed_m_per_s = 0.25;
inline constexpr double reduced_acceleration_m_per_s2 = 10.0;

// `root` is the cell's file, of which all but the profile has been read. Throws SetupError where the cell isn't so.
void apply_hand_guiding(const YamlNode& root, Cell& cell);

}  // namespace proxarm::description
