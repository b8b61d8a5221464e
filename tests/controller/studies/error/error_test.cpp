#include "controller/extras/studies/error/error.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "controller/extras/studies/error/error_cases.hpp"

namespace proxarm::studies {
namespace {

using models::Vec3;

// The exact solutions obey M ẍ = h + f, by differences, where nothing jumps.
TEST(ErrorCases, AreSolutions) {
  for (const ErrorCase& which : error_cases()) {
    for (int i = 1; i < 40; ++i) {
      const double t = which.duration_s * (i - 0.37) / 40.0, d = 1e-5;
      const CaseState before = which.exact(t - d), now = which.exact(t), after = which.exact(t + d);
      const bool jumps = (after.f - before.f).norm() > 0.1 || (after.v - before.v).norm() > 0.01;
      if (jumps) continue;
      EXPECT_LT(((after.q - before.q) / (2.0 * d) - now.v).norm(), 1e-6) << which.name << " at " << t;
      const Vec3 a = (after.v - before.v) / (2.0 * d);
      EXPECT_LT((which.mass_kg * a - which.force(t, now.q, now.v) - now.f).norm(), 1e-5) << which.name << " at " << t;
    }
  }
}

// Orders of convergence as theory says: (26) is of order 2 in free flight and straight slides, of 1 where normal or
// direction turns; order 2 is of 3 in free flight and where a curve is even, of 2 on other smooth motion.
TEST(ErrorStudy, ConvergesAsTheorySays) {
  const ErrorStudy study;
  const Options options{.quick = true};
  Table table(study.columns());
  const std::size_t methods = study.jobs(options) / error_cases().size();
  for (std::size_t job = 0; job < study.jobs(options); ++job) {
    const std::string name = error_cases()[job / methods].name;
    if (name.rfind("free", 0) != 0 && name != "geodesic" && name != "pendulum") continue;  // the others take longer
    for (const Row& row : study.run(job, options)) table.add(job, row);
  }
  const nlohmann::json headline = study.headline(table, options);
  const auto order = [&](const char* name, const char* method) {
    return headline.at("order").at(name).at(method).get<double>();
  };
  EXPECT_EQ(order("free_constant", "1"), 0.0);  // exact
  EXPECT_NEAR(order("free_sine", "1"), 2.0, 0.1);
  EXPECT_NEAR(order("free_sine", "2"), 3.0, 0.2);
  EXPECT_NEAR(order("geodesic", "1"), 1.0, 0.15);
  EXPECT_NEAR(order("geodesic", "2"), 3.0, 0.25);
  EXPECT_NEAR(order("pendulum", "1"), 1.0, 0.15);
  EXPECT_NEAR(order("pendulum", "2"), 2.0, 0.3);
  const auto& rate = headline.at("energy_rate");
  for (const char* side : {"concave", "convex"}) {
    const double measured = rate.at(side).at("measured_per_s"), predicted = rate.at(side).at("predicted_per_s");
    EXPECT_NEAR(measured / predicted, 1.0, 0.02) << side;
  }
}

}  // namespace
}  // namespace proxarm::studies
