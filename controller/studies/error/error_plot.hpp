// The error study's plots, and the sentences that they answer with.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"
#include "controller/studies/error/error_runs.hpp"

namespace proxarm::studies {

// In how many motions order 2 needs less time for the same error than the best of the others, each tuned to the motion.
std::string work_answer(const RunsByCase& all);

// In how many motions each order is as accurate as it promises: exact, or with an error that falls by T² or faster.
std::string order_answer(const RunsByCase& all);

// With steps of 1 ms: what order 2 errs by at most, and what the best penalty method does.
std::string glance_answer(const RunsByCase& all);

// Writes error.svg, error_order.svg and error_at_1ms.svg. Returns warnings.
std::vector<std::string> draw_errors(const Table& table, const std::filesystem::path& out);

}  // namespace proxarm::studies
