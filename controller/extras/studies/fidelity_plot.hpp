// Draws the fidelity study's plots, and makes their titles, which state the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/studies/common/table.hpp"

namespace proxarm::studies {

// The titles state up to which frequency the drawn setups feel right within 10 % in the worst direction. The first
// title is about one mass without additions, with lookahead and with measured torque; the second title is about all
// inertias of a tool that turns.
std::string fidelity_answer(const Table& table);
std::string fidelity_turning_answer(const Table& table);

// Writes fidelity.svg and fidelity_turning.svg. Returns warnings.
std::vector<std::string> draw_fidelity(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
