// Measures how the time of a step and of start-up grows with the size of a world. Distant objects must cost nothing.
//
// A world has one to thousands of spheres on a grid, or a mesh of up to a hundred thousand triangles. The proxy is far
// from all objects, near one object, or slides on one. For comparison, the study measures the time to evaluate every
// object. It also measures the cost of each option of a scene. An unused option costs nothing, because 𝒢 is compiled
// without it. For whole cycles, the study counts the computations besides 𝒢, and how often they are skipped. The caller
// provides the function that runs cycles.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "controller/extras/studies/common/study.hpp"

namespace proxarm::studies {

// A session of the simulated arm. Files are named by their paths in the source tree; empty: the default file.
struct CycleSetup {
  const char* name = "";
  const char *cell = "", *scene = "", *hand = "";
  bool looks_ahead = false;  // --lookahead auto
};
// Counts over the session's rendering steps. controller/motion/motion_work.hpp explains them.
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

// Returns the plot's title: the time of a step in the largest worlds, and whether the worlds' size matters.
std::string skip_answer(const Table& table);

}  // namespace proxarm::studies
