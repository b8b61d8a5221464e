// Draws the error study's plots, and makes their titles, which state the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/studies/common/table.hpp"
#include "controller/extras/studies/error/error_runs.hpp"

namespace proxarm::studies {

// Returns the title that states in how many motions order 2 needs less time for the same error than the best other
// method with the best tuning for the motion.
std::string work_answer(const RunsByCase& all);

// Returns the title that states in how many motions each order is exact or has an error that falls as T² or faster.
std::string order_answer(const RunsByCase& all);

// Returns the title that states the largest error with steps of 1 ms, for order 2 and for the best penalty method.
std::string glance_answer(const RunsByCase& all);

// Writes error.svg, error_order.svg and error_at_1ms.svg. Returns warnings.
std::vector<std::string> draw_errors(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
