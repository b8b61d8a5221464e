#include "controller/extras/studies/figure5.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace proxarm::studies {
namespace {

Table all_runs(const Study& study, const Options& options) {
  Table table(study.columns());
  for (std::size_t job = 0; job < study.jobs(options); ++job) {
    for (const Row& row : study.run(job, options)) table.add(job, row);
  }
  return table;
}

double figure(const nlohmann::json& headline, const char* key, const char* law) {
  return headline.at(key).at(law).get<double>();
}

// What the paper's Fig. 5 shows: (5) sucks and kicks, (23) does neither, and both are damped.
TEST(Figure5, ShowsWhatThePaperShows) {
  const Figure5 study;
  const Options options;
  const nlohmann::json headline = study.headline(all_runs(study, options), options);
  EXPECT_GT(figure(headline, "pull_force_N", "5"), 0.1);
  EXPECT_EQ(figure(headline, "pull_force_N", "23"), 0.0);
  EXPECT_GT(figure(headline, "kick_N", "5"), 0.1);
  EXPECT_LE(figure(headline, "kick_N", "23"), 1e-12);
  EXPECT_GT(figure(headline, "oscillation_N", "1"), 1.0);
  EXPECT_LT(figure(headline, "oscillation_N", "5"), 0.1);
  EXPECT_LT(figure(headline, "oscillation_N", "23"), 0.1);
}

TEST(Figure5, ItsTitleSaysWhatEachLawDoes) {
  const auto headline = [](double swing_1_N, double pull_5_N, double pull_23_N) {
    return nlohmann::json{{"oscillation_N", {{"1", swing_1_N}, {"5", 0.0}, {"23", 0.0}}},
                          {"pull_force_N", {{"1", 0.0}, {"5", pull_5_N}, {"23", pull_23_N}}}};
  };
  EXPECT_EQ(figure5_answer(headline(9.65, 0.4213, 0.0)),
            "Resting on the wall, (1) swings by 9.65 N; on leaving it, (5) pulls with 0.421 N; (23) does neither");
  EXPECT_EQ(figure5_answer(headline(0.0, 0.0, 0.2)),
            "Resting on the wall, (1) is steady; on leaving it, (5) doesn't pull; (23) does one of these, too");
}

}  // namespace
}  // namespace proxarm::studies
