// Defines the exit statuses. A session in which the arm oscillated by itself for a second or more
// (report/oscillation.hpp) ends with fault_ended_the_run.
#pragma once

namespace proxarm::command_line {

inline constexpr int fine = 0;
inline constexpr int fault_ended_the_run = 1;
inline constexpr int set_up_mistake = 2;

}  // namespace proxarm::command_line
