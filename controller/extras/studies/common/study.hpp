// Runs studies: runs jobs on all cores with a progress bar, runs and merges parts of a study (shards), and writes the
// files
//   NAME.csv   every run
//   NAME.json  the headline figures, their meaning (`keys`), and their origin: seed, machine, command, version
//   *.svg      plots
//
// A study consists of independent jobs. Headline and plots depend on the table alone, so merged parts give the same
// files as a single run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "controller/extras/studies/common/table.hpp"

namespace proxarm::studies {

struct Options {
  bool quick = false;            // fewer and coarser runs, for a first look and for continuous integration
  std::uint64_t seed = 1;        // seed of all random numbers
  std::optional<double> runs{};  // number of runs, for studies that have one; unset: the study's own number
};

// The I-th of N parts of a study, counted from 1. It has the jobs I−1, I−1+N, …
struct Shard {
  std::size_t index = 1, count = 1;
  // Parses "2/8". Throws description::SetupError.
  static Shard parse(const std::string& text);
  [[nodiscard]] bool whole() const noexcept { return count == 1; }
};

class Study {
 public:
  Study() = default;
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;
  virtual ~Study() = default;

  [[nodiscard]] virtual std::string name() const = 0;
  [[nodiscard]] virtual std::vector<Column> columns() const = 0;
  [[nodiscard]] virtual std::size_t jobs(const Options& options) const = 0;
  // Runs one job and returns at least one row. Several threads call it at once.
  [[nodiscard]] virtual std::vector<Row> run(std::size_t job, const Options& options) const = 0;
  // Returns the headline figures of the whole table, and their meanings as {"keys": {name: meaning}}.
  [[nodiscard]] virtual nlohmann::json headline(const Table& table, const Options& options) const = 0;
  // Writes the plots into the folder `out`. Returns warnings.
  [[nodiscard]] virtual std::vector<std::string> plot(const Table& table, const Options& options,
                                                      const std::filesystem::path& out) const = 0;
  // Returns a few lines for people.
  [[nodiscard]] virtual std::string text(const nlohmann::json& headline) const = 0;
  // Returns whether the study found a violation. If so, the exit status is 1.
  [[nodiscard]] virtual bool failed(const nlohmann::json& /*headline*/) const { return false; }
};

struct Outcome {
  std::string text;
  std::vector<std::string> warnings;
  bool failed = false;
};

// Runs the shard's jobs on `threads` threads (0: one per core), shows progress on a terminal, and writes the files. For
// a part of a study, these files are a CSV, and a JSON that names the part.
Outcome run_study(const Study& study, const Options& options, const Shard& shard, const std::filesystem::path& out,
                  const std::string& command, unsigned threads = 0);

// Joins the parts of a study in the folders `parts` and writes the study's files to `out`. Throws
// description::SetupError if parts are missing, occur twice, or differ in study or seed.
Outcome merge_study(const std::function<const Study&(const std::string&)>& study_named,
                    const std::vector<std::filesystem::path>& parts, const std::filesystem::path& out);

// Calls work(i) for all i < count on `threads` threads (0: one per core). Rethrows an exception of a call.
void parallel(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work);

// Returns the seed of a job, which is derived from the study's seed.
std::uint64_t job_seed(std::uint64_t seed, std::size_t job);

// Returns "model name, N cores", with the model's name from /proc/cpuinfo.
std::string machine();

}  // namespace proxarm::studies
