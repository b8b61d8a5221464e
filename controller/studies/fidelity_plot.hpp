// The fidelity study's plots, and their titles, which state the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// The frequencies up to which the drawn setups feel right within 10 % in the worst direction: one mass plain, with
// lookahead and with measured torque; and all inertias of a tool that turns.
std::string fidelity_answer(const Table& table);
std::string fidelity_turning_answer(const Table& table);

// Writes fidelity.svg and fidelity_turning.svg. Returns warnings.
std::vector<std::string> draw_fidelity(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
