// What a step and start-up cost against the size of a world: objects that are far away must not cost anything.
//
// The worlds have 1 to thousands of spheres on a grid, or meshes of up to a hundred thousand triangles. The proxy is
// far from all, near one, or slides on one; the cost is compared with evaluating every object at every step. The study
// also measures what each option of a scene costs when it is used. Unused it must cost nothing, since the 𝒢 is compiled
// without it.
#pragma once

#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

class Skip final : public Study {
 public:
  std::string name() const override { return "skip"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
};

}  // namespace proxarm::studies
