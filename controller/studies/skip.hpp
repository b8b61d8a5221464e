// Measures the cost of a step and of start-up against the size of a world: distant objects must cost nothing.
//
// The worlds have one to thousands of spheres on a grid, or meshes of up to a hundred thousand triangles. The proxy is
// far from all objects, near one, or slides on one; evaluating every object in every step is the comparison. The study
// also measures each option of a scene; unused options cost nothing, since 𝒢 is compiled without them. For whole cycles
// it counts what they compute around 𝒢 and how often they skip it. The caller provides the cycles.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

// A session of the simulated arm. Files are named as in the source tree; empty: the default ones.
struct CycleSetup {
  const char* name = "";
  const char *cell = "", *scene = "", *hand = "";
  bool looks_ahead = false;  // --lookahead auto
};
// Counts over the session's rendering steps, explained in controller/motion/motion_work.hpp.
struct CycleCounts {
  std::uint64_t steps = 0, programs = 0, limited = 0, joint_steps = 0, guarded = 0;
};
using CycleRun = std::function<CycleCounts(const CycleSetup&)>;

class Skip final : public Study {
 public:
  explicit Skip(CycleRun cycles) : cycles_(std::move(cycles)) {}

  std::string name() const override { return "skip"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;

 private:
  CycleRun cycles_;
};

// The plot's title: the time of a step in the largest worlds, and whether their size matters.
std::string skip_answer(const Table& table);

}  // namespace proxarm::studies
