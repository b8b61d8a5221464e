// Up to which frequency the hand feels what was asked for, of the fidelity study's table.
#pragma once

#include <array>
#include <map>
#include <string>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// Errors of the mass felt that are asked about.
inline constexpr std::array<double, 3> fidelity_limits{0.05, 0.1, 0.25};

// Below it only a few periods are measured.
inline constexpr double lowest_band_Hz = 0.3;

// Up to which frequency, from 0.3 Hz on, the error stays below a limit: between two that were measured, on the straight
// line through their logarithms. 0: not even there.
double band_Hz(const std::map<double, double>& error_of_Hz, double limit);

// "up to 1.2 Hz", or what there is to say where the error passes the limit nowhere, or from the beginning on.
std::string band_text(const std::map<double, double>& error_of_Hz, double limit);

// "5 %"
std::string percent_text(double share);

// Whether a row is of a tool that turns.
bool is_turning(const Table& table, std::size_t row);

// "4 kg, T = 1 ms, lookahead": a row's setup.
std::string fidelity_label(const Table& table, std::size_t row);

}  // namespace proxarm::studies
