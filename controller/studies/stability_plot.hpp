// The stability map's plots, and the sentences that they answer with.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"

namespace proxarm::studies {

// Sensitivities of the boundary from which on measured and predicted mass aren't compared.
inline constexpr double well_conditioned = 3.0;

// The mass that is stable with the heaviest hand at the longest delay, at the timestep next to 1 ms: up to which
// stiffness of the hand, and from which on none is.
std::string stability_answer(const Table& table);

// By how much the smallest mass that was measured differs from the predicted one, and of how many points.
std::string agreement_answer(const Table& table);

// Writes stability.svg and stability_agreement.svg. Returns warnings.
std::vector<std::string> draw_stability(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
