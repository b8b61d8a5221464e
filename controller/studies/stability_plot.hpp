// The stability map's plots, and their titles, which state the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// Measured and predicted mass are compared only below this sensitivity of the boundary.
inline constexpr double well_conditioned = 3.0;

// For each drawn delay the hand's stiffness up to which some mass is stable, with a hand of 1 kg and 20 Ns/m at the
// timestep nearest to 1 ms.
std::string stability_answer(const Table& table);

// The largest difference between measured and predicted smallest mass, and the number of points.
std::string agreement_answer(const Table& table);

// Writes stability.svg and stability_agreement.svg. Returns warnings.
std::vector<std::string> draw_stability(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
