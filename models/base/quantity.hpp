// Reads numbers with units from the command line: 1ms, 0.5 ms, 3kg, 20Ns/m.
//
// The unit is required if a number alone would be ambiguous, such as a duration's. All functions throw SetupError
// naming `option`, the text that the user typed, such as "--timestep".
#pragma once

#include <string_view>

namespace proxarm::description {

// "1ms", "0.5ms", "500us", "500µs", "2s", "1min", "24h", "250000ns" → seconds, above zero. The unit is required.
double parse_duration(std::string_view text, std::string_view option = "duration");

// "3", "3kg", "250g" → kg, above zero.
double parse_mass(std::string_view text, std::string_view option = "mass");

// "20", "20Ns/m" → Ns/m, zero or more.
double parse_damping(std::string_view text, std::string_view option = "damping");

// "500", "500N/m" → N/m, zero or more.
double parse_stiffness(std::string_view text, std::string_view option = "stiffness");

// "0.02", "0.02kgm2", "0.02kgm²" → kg m², above zero.
double parse_inertia(std::string_view text, std::string_view option = "inertia");

// "0.5", "0.5Nms/rad" → Nms/rad, zero or more.
double parse_turning_damping(std::string_view text, std::string_view option = "turning-damping");

// "20", "20Nm/rad" → Nm/rad, zero or more.
double parse_turning_stiffness(std::string_view text, std::string_view option = "turning-spring");

// "20mm", "0.02m" → m, above zero. The unit is required.
double parse_length(std::string_view text, std::string_view option = "length");

// "20", "20N" → N, above zero.
double parse_force(std::string_view text, std::string_view option = "force");

// "100", "100Nm" → Nm, zero or more.
double parse_torque(std::string_view text, std::string_view option = "torque");

// "0.005", "5mrad", "0.005rad" → rad, above zero.
double parse_angle(std::string_view text, std::string_view option = "angle");

// "0.5", "0.5rad/s" → rad/s, above zero.
double parse_angular_speed(std::string_view text, std::string_view option = "speed");

// "0.5", "0.5N/s" → N/s, above zero.
double parse_force_rate(std::string_view text, std::string_view option = "drift");

// "2", "0.5": a plain number above zero.
double parse_factor(std::string_view text, std::string_view option = "factor");

}  // namespace proxarm::description
