// Reads numbers with units from the command line: 1ms, 0.5 ms, 3kg, 20Ns/m.
//
// A unit is required where a number alone would be ambiguous, as for a duration. All functions throw SetupError. The
// error names `option`, which is the option that the user typed, such as "--timestep".
#pragma once

#include <string_view>

namespace proxarm::description {

// Reads "1ms", "0.5ms", "500us", "500µs", "2s", "1min", "24h" or "250000ns". Returns seconds, above zero. The unit is
// required.
double parse_duration(std::string_view text, std::string_view option = "duration");

// Reads "3", "3kg" or "250g". Returns kg, above zero.
double parse_mass(std::string_view text, std::string_view option = "mass");

// Reads "20" or "20Ns/m". Returns Ns/m, zero or more.
double parse_damping(std::string_view text, std::string_view option = "damping");

// Reads "500" or "500N/m". Returns N/m, zero or more.
double parse_stiffness(std::string_view text, std::string_view option = "stiffness");

// Reads "0.02", "0.02kgm2" or "0.02kgm²". Returns kg m², above zero.
double parse_inertia(std::string_view text, std::string_view option = "inertia");

// Reads "0.5" or "0.5Nms/rad". Returns Nms/rad, zero or more.
double parse_turning_damping(std::string_view text, std::string_view option = "turning-damping");

// Reads "20" or "20Nm/rad". Returns Nm/rad, zero or more.
double parse_turning_stiffness(std::string_view text, std::string_view option = "turning-spring");

// Reads "20mm" or "0.02m". Returns m, above zero. The unit is required.
double parse_length(std::string_view text, std::string_view option = "length");

// Reads "20" or "20N". Returns N, above zero.
double parse_force(std::string_view text, std::string_view option = "force");

// Reads "100" or "100Nm". Returns Nm, zero or more.
double parse_torque(std::string_view text, std::string_view option = "torque");

// Reads "0.005", "5mrad" or "0.005rad". Returns rad, above zero.
double parse_angle(std::string_view text, std::string_view option = "angle");

// Reads "0.5" or "0.5rad/s". Returns rad/s, above zero.
double parse_angular_speed(std::string_view text, std::string_view option = "speed");

// Reads "0.5" or "0.5N/s". Returns N/s, above zero.
double parse_force_rate(std::string_view text, std::string_view option = "drift");

// Reads a number without a unit, such as "2" or "0.5". Returns a number above zero.
double parse_factor(std::string_view text, std::string_view option = "factor");

}  // namespace proxarm::description
