// Finds from the fidelity study's table up to which frequency the hand feels the requested mass.
#pragma once

#include <array>
#include <map>
#include <string>

#include "controller/extras/studies/common/table.hpp"

namespace proxarm::studies {

// The limits of the felt mass's error for which bands are found.
inline constexpr std::array<double, 3> fidelity_limits{0.05, 0.1, 0.25};

// Bands begin at this frequency, because at lower ones only a few periods are measured.
inline constexpr double lowest_band_Hz = 0.3;

// Returns the frequency up to which, from lowest_band_Hz on, the error stays below the limit. Between measured points,
// the logarithm of the error is linear in the logarithm of the frequency. Returns 0 if the error is above the limit
// from the beginning.
double band_Hz(const std::map<double, double>& error_of_Hz, double limit);

// Returns the band as text, such as "up to 1.2 Hz". There are also texts for an error that stays below the limit, and
// for one that is above the limit from the beginning.
std::string band_text(const std::map<double, double>& error_of_Hz, double limit);

// Returns the share as text, for example "5 %".
std::string percent_text(double share);

// Returns whether a row was measured with a tool that turns.
bool is_turning(const Table& table, std::size_t row);

// Returns a row's setup as text, for example "4 kg, T = 1 ms, lookahead".
std::string fidelity_label(const Table& table, std::size_t row);

}  // namespace proxarm::studies
