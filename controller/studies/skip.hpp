// What a step and start-up cost against the size of a world: objects that are far away must not cost anything.
//
// The worlds have 1 to thousands of spheres on a grid, or meshes of up to a hundred thousand triangles. The proxy is
// far from all, near one, or slides on one; the cost is compared with evaluating every object at every step. The study
// also measures what each option of a scene costs when it is used. Unused it must cost nothing, since the 𝒢 is compiled
// without it. Of whole cycles it counts what they compute around 𝒢, and how often they can leave it out.
//
// The caller provides the cycles: the studies know no arm.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

// A session of the simulated arm; its files as the source tree has them, empty for the default ones.
struct CycleSetup {
  const char* name = "";
  const char *cell = "", *scene = "", *hand = "";
  bool looks_ahead = false;  // --lookahead auto
};
// Counts over its steps of rendering; controller/motion/motion_work.hpp says what they are.
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

// The plot's title: what a step takes in the largest worlds, and whether their size matters.
std::string skip_answer(const Table& table);

}  // namespace proxarm::studies
