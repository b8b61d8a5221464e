// What a step costs, and what start-up costs, against the size of a world: only what is near may count.
//
// Worlds of 1 to thousands of spheres on a grid, and meshes of up to a hundred thousand triangles; the proxy far from
// all, near one, and sliding on one; against evaluating every object at every step. And what each option of a scene
// costs when it is there, and when it isn't, which must be nothing: the 𝒢 is then another one.
#pragma once

#include "controller/studies/study.hpp"

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
