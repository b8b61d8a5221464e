// Measures the error of (26) for a rigid tool, and the time of a step. The motions have known exact solutions
// (tool_cases.hpp), and the steps are 16 ms to 0.125 ms long.
//
// The errors are the rms over all steps of the reference point's distance from its exact place, and of the tool's angle
// from its exact orientation. The proxy gets the hand's wrench at the samples only. The pose q(k) is made from h(t_k)
// and compared at t_{k+1}. The velocity given at the start is the exact one half a step earlier. Where within a step an
// event happens is chance, so each run is repeated with starts spread over a step, and the median counts.
#pragma once

#include "controller/extras/studies/common/study.hpp"

namespace proxarm::studies {

class ToolErrorStudy final : public Study {
 public:
  std::string name() const override { return "error_tools"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
};

// Returns the plot's title: the largest error of a tool with steps of 1 ms, and in which motion.
std::string tool_error_answer(const Table& table);

}  // namespace proxarm::studies
