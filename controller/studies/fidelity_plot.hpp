// The fidelity study's plots, and the sentences that they answer with.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// Up to which frequency what is drawn feels within 10 %, at worst over directions: of one mass without anything, with
// lookahead and with measured torque; of all inertias of a tool that turns.
std::string fidelity_answer(const Table& table);
std::string fidelity_turning_answer(const Table& table);

// Writes fidelity.svg and fidelity_turning.svg. Returns warnings.
std::vector<std::string> draw_fidelity(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
