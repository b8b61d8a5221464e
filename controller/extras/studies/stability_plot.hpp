// Draws the stability map's plots, and makes their titles, which state the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/studies/common/table.hpp"

namespace proxarm::studies {

// Measured and predicted mass are compared only where the boundary's sensitivity is below this value.
inline constexpr double well_conditioned = 3.0;

// Returns the map's title: for each drawn delay, up to which stiffness of the hand which mass is enough, with a hand of
// 1 kg and 20 Ns/m at the timestep nearest to 1 ms.
std::string stability_answer(const Table& table);

// Returns the title of the comparison: the largest difference between the measured and the predicted smallest mass, and
// the number of points.
std::string agreement_answer(const Table& table);

// Writes stability.svg and stability_agreement.svg. Returns warnings.
std::vector<std::string> draw_stability(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
