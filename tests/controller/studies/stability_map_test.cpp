#include "controller/extras/studies/stability_map.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace proxarm::studies {
namespace {

using controller::HandModel;
using controller::LoopModel;

// On half of the coarse grid's lines: simulation and eigenvalues find the same boundary.
TEST(StabilityMap, MeasuresWhatEigenvaluesPredict) {
  const StabilityMap study;
  const Options options{.quick = true};
  Table table(study.columns());
  for (std::size_t job = 0; job < study.jobs(options); job += 2) {
    for (const Row& row : study.run(job, options)) table.add(job, row);
  }
  const nlohmann::json headline = study.headline(table, options);
  EXPECT_LT(headline.at("boundary_error_max").get<double>(), 0.02);
  EXPECT_GT(headline.at("compared").get<int>(), 80);
  EXPECT_EQ(headline.at("no_stable_mass_disagree").get<int>(), 0);
  EXPECT_EQ(headline.at("not_found").get<int>(), 0);
  EXPECT_GT(headline.at("contact_points").get<int>(), 10);
  EXPECT_EQ(headline.at("contact_diverged").get<int>(), 0);
  EXPECT_LT(headline.at("d1_error_max").get<double>(), 1e-6);
}

TEST(StabilityMap, TheBoundaryOfAnIdealLoopIsMeasuredToo) {
  const HandModel hand{1000.0, 10.0, 0.0};
  LoopModel loop;
  loop.period_s = 1e-3;
  EXPECT_NEAR(measured_boundary_kg(hand, loop, 6e-3), 5.25e-3, 0.02 * 5.25e-3);
}

}  // namespace
}  // namespace proxarm::studies
