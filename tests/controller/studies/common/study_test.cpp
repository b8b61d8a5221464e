#include "controller/extras/studies/common/study.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::studies {
namespace {

namespace fs = std::filesystem;

// Rows that no decimal of few digits holds.
class Thirds final : public Study {
 public:
  std::string name() const override { return "thirds"; }
  std::vector<Column> columns() const override { return {{"kind", true}, {"third"}}; }
  std::size_t jobs(const Options& options) const override { return options.quick ? 5 : 23; }
  std::vector<Row> run(std::size_t job, const Options& options) const override {
    std::vector<Row> rows;
    for (std::size_t i = 0; i <= job % 3; ++i) {
      rows.push_back(
          {std::string(i == 0 ? "first" : "next"), static_cast<double>(job_seed(options.seed, job) + i) / 3.0});
    }
    return rows;
  }
  nlohmann::json headline(const Table& table, const Options& /*options*/) const override {
    double sum = 0.0;
    for (std::size_t row = 0; row < table.rows(); ++row) sum += table.number(row, table.column("third"));
    return {{"sum", sum}};
  }
  std::vector<std::string> plot(const Table& /*table*/, const Options& /*options*/,
                                const fs::path& /*out*/) const override {
    return {};
  }
  std::string text(const nlohmann::json& headline) const override { return headline.at("sum").dump(); }
};

class StudyFiles : public testing::Test {
 protected:
  Outcome merge(const std::vector<fs::path>& parts, const fs::path& out) const {
    return merge_study([this](const std::string&) -> const Study& { return study; }, parts, out);
  }

  Thirds study;
  const tests::ScratchFolder folder;
};

TEST_F(StudyFiles, PartsThatAreMergedGiveTheFilesOfOneRun) {
  const Options options{.seed = 7};
  run_study(study, options, {}, folder / "one", "one", 1);
  std::vector<fs::path> parts;
  for (std::size_t i = 1; i <= 4; ++i) {
    parts.push_back(folder / std::to_string(i));
    run_study(study, options, {i, 4}, parts.back(), "part", 2);
  }
  merge({parts[2], parts[0], parts[3], parts[1]}, folder / "merged");
  EXPECT_EQ(tests::text_of(folder / "one/thirds.csv"), tests::text_of(folder / "merged/thirds.csv"));
  const auto one = nlohmann::json::parse(tests::text_of(folder / "one/thirds.json"));
  const auto merged = nlohmann::json::parse(tests::text_of(folder / "merged/thirds.json"));
  EXPECT_EQ(one.at("sum"), merged.at("sum"));
  EXPECT_FALSE(merged.contains("shard"));
}

TEST_F(StudyFiles, PartsThatDontMakeAWholeAreRefused) {
  const fs::path a = folder / "a", b = folder / "b", c = folder / "c";
  run_study(study, {.seed = 7}, {1, 2}, a, "part", 1);
  run_study(study, {.seed = 8}, {2, 2}, b, "part", 1);
  run_study(study, {.seed = 7}, {2, 2}, c, "part", 1);
  EXPECT_THROW(merge({a}, folder / "out"), description::SetupError);        // half of it
  EXPECT_THROW(merge({a, a, c}, folder / "out"), description::SetupError);  // one twice
  EXPECT_THROW(merge({a, b}, folder / "out"), description::SetupError);     // another seed
  EXPECT_THROW(merge({a, folder.path()}, folder / "out"), description::SetupError);
  EXPECT_THROW(merge({a, c}, folder / "b/../a"), description::SetupError);  // over one of its parts
  std::ofstream(c / "thirds.csv", std::ios::app) << "3,first,abc\n";
  EXPECT_THROW(merge({a, c}, folder / "out"), description::SetupError);  // not a number
}

TEST_F(StudyFiles, NoRunsAreRefused) {
  EXPECT_THROW(run_study(study, {.runs = 0.0}, {}, folder / "out", "x", 1), description::SetupError);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(StudyFiles, ManyThreadsMakeTheFilesOfOne) {
  run_study(study, {}, {}, folder / "one", "x", 1);
  run_study(study, {}, {}, folder / "four", "x", 4);
  EXPECT_EQ(tests::text_of(folder / "one/thirds.csv"), tests::text_of(folder / "four/thirds.csv"));
}

TEST(Shard, IsAPartOfAWhole) {
  EXPECT_EQ(Shard::parse("2/8").index, 2u);
  for (const char* bad : {"0/8", "9/8", "1", "a/b", "1/", "/2", "-1/2", "1/2/3", "1/99999999"}) {
    EXPECT_THROW(Shard::parse(bad), description::SetupError) << bad;
  }
}

}  // namespace
}  // namespace proxarm::studies
