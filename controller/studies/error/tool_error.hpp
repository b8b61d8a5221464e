// How exact (26) is for a rigid tool, and what a step takes: motions whose exact solution is known (tool_cases.hpp),
// with steps of 16 ms to 0.125 ms.
//
// Error: rms over all steps of how far the reference point is off, and by what angle the tool is. The proxy gets the
// hand's wrench at the samples and nothing between them; its pose q(k), made of h(t_k), stands for t_{k+1}, and its
// first velocity for half a step before the start. Where an event falls within a step is chance: each run is repeated
// with beginnings spread over a step, and the median counts.
#pragma once

#include "controller/studies/common/study.hpp"

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

// The plot's title: what a tool errs by at most with steps of 1 ms, and in which motion.
std::string tool_error_answer(const Table& table);

}  // namespace proxarm::studies
