// Finds in the fidelity study's table up to which frequency the hand feels the requested mass.
#pragma once

#include <array>
#include <map>
#include <string>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// Limits for the error of the felt mass.
inline constexpr std::array<double, 3> fidelity_limits{0.05, 0.1, 0.25};

// Below this frequency only a few periods are measured.
inline constexpr double lowest_band_Hz = 0.3;

// The frequency up to which, from 0.3 Hz on, the error stays below a limit; interpolated linearly between the
// logarithms of the measured points. 0: above the limit from the beginning.
double band_Hz(const std::map<double, double>& error_of_Hz, double limit);

// The band in words, such as "up to 1.2 Hz"; also if the error stays below the limit, or is above it from the
// beginning.
std::string band_text(const std::map<double, double>& error_of_Hz, double limit);

// For example "5 %".
std::string percent_text(double share);

// Whether a row is of a tool that turns.
bool is_turning(const Table& table, std::size_t row);

// A row's setup, for example "4 kg, T = 1 ms, lookahead".
std::string fidelity_label(const Table& table, std::size_t row);

}  // namespace proxarm::studies
