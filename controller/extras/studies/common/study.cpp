#include "controller/extras/studies/common/study.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "controller/report/progress.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::studies {
namespace {

namespace fs = std::filesystem;
using description::SetupError;
using nlohmann::json;

void write_json(const fs::path& file, const json& value) {
  std::ofstream out(file);
  out << value.dump(1) << "\n";
  if (!out.flush()) throw std::runtime_error(file.string() + ": can't be written");
}

json read_json(const fs::path& file) {
  std::ifstream in(file);
  json value = json::parse(in, nullptr, false);
  if (!in || value.is_discarded() || !value.is_object() || !value.value("study", json()).is_string() ||
      !value.value("jobs", json()).is_number_unsigned() || !value.value("seed", json()).is_number_unsigned()) {
    throw SetupError({.file = file.string(),
                      .key = "study",
                      .found = in ? "something else" : "no such file",
                      .expected = "the JSON file of a study"});
  }
  return value;
}

void make_folder(const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error) {
    throw SetupError(
        {.key = "--out", .found = out.string(), .expected = "a folder that can be made (" + error.message() + ")"});
  }
}

json provenance(const Study& study, const Options& options, const std::string& command) {
  json about{{"study", study.name()},       {"seed", options.seed}, {"quick", options.quick},
             {"jobs", study.jobs(options)}, {"machine", machine()}, {"command", command},
             {"version", PROXARM_VERSION}};
  if (options.runs) about["asked_runs"] = *options.runs;
  return about;
}

Outcome finish(const Study& study, const Options& options, Table& table, json about, const fs::path& out) {
  table.sort_by_job();
  table.write_csv(out / (study.name() + ".csv"));
  const json headline = study.headline(table, options);
  about.update(headline);
  write_json(out / (study.name() + ".json"), about);
  Outcome outcome;
  outcome.warnings = study.plot(table, options, out);
  outcome.text = study.text(about);
  outcome.failed = study.failed(about);
  return outcome;
}

}  // namespace

Shard Shard::parse(const std::string& text) {
  const auto refuse = [&] {
    throw SetupError({.key = "--shard", .found = "'" + text + "'", .expected = "I/N with 1 ≤ I ≤ N, such as 2/8"});
  };
  const std::size_t slash = text.find('/');
  const auto whole_number = [&](const std::string& digits) {
    if (digits.empty() || digits.size() > 6 || digits.find_first_not_of("0123456789") != std::string::npos) refuse();
    return static_cast<std::size_t>(std::stoul(digits));
  };
  if (slash == std::string::npos) refuse();
  const Shard shard{whole_number(text.substr(0, slash)), whole_number(text.substr(slash + 1))};
  if (shard.index < 1 || shard.index > shard.count) refuse();
  return shard;
}

void parallel(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work) {
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  threads = static_cast<unsigned>(std::min<std::size_t>(threads, std::max<std::size_t>(count, 1)));
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex lock;
  const auto worker = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard<std::mutex> held(lock);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> others;
  for (unsigned i = 1; i < threads; ++i) others.emplace_back(worker);
  worker();
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

// Source: SplitMix64, Steele et al. 2014.
std::uint64_t job_seed(std::uint64_t seed, std::size_t job) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15u + static_cast<std::uint64_t>(job) + 0x632BE59BD9B4E019u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return (z ^ (z >> 31)) >> 11;  // 53 bits, which CSV and JSON hold exactly
}

std::string machine() {
  std::ifstream in("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(in, line)) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      model = line.substr(colon + 2);
      break;
    }
  }
  return model + ", " + std::to_string(std::max(1u, std::thread::hardware_concurrency())) + " cores";
}

Outcome run_study(const Study& study, const Options& options, const Shard& shard, const fs::path& out,
                  const std::string& command, unsigned threads) {
  if (options.runs && !(*options.runs >= 1.0)) {
    throw SetupError(
        {.key = "--runs", .found = std::to_string(static_cast<long long>(*options.runs)), .expected = "1 or more"});
  }
  make_folder(out);
  Table table(study.columns());
  const std::size_t jobs = study.jobs(options);
  const std::size_t mine = jobs < shard.index ? 0 : (jobs - shard.index) / shard.count + 1;
  controller::Progress progress(static_cast<double>(mine), stderr, "jobs");
  std::mutex lock;
  std::size_t done = 0;
  const auto begun = std::chrono::steady_clock::now();
  parallel(mine, threads, [&](std::size_t i) {
    const std::size_t job = shard.index - 1 + i * shard.count;
    const std::vector<Row> rows = study.run(job, options);
    const std::lock_guard<std::mutex> held(lock);
    for (const Row& row : rows) table.add(job, row);
    ++done;
    progress.update(static_cast<double>(done), study.name());
  });
  progress.clear();
  json about = provenance(study, options, command);
  about["run_time_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  if (shard.whole()) return finish(study, options, table, about, out);
  table.sort_by_job();
  table.write_csv(out / (study.name() + ".csv"));
  about["shard"] = {{"index", shard.index}, {"count", shard.count}};
  write_json(out / (study.name() + ".json"), about);
  return {study.name() + ": part " + std::to_string(shard.index) + " of " + std::to_string(shard.count) + ", " +
              std::to_string(mine) + " jobs; join the parts with proxarm study merge\n",
          {},
          false};
}

Outcome merge_study(const std::function<const Study&(const std::string&)>& study_named,
                    const std::vector<fs::path>& parts, const fs::path& out) {
  std::vector<fs::path> files;
  for (const fs::path& part : parts) {
    std::error_code ignored;
    if (fs::equivalent(part, out, ignored)) {
      throw SetupError(
          {.key = "--out", .found = out.string() + ", which is one of the parts", .expected = "another folder"});
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(part, ignored)) {
      if (entry.path().extension() == ".json") found.push_back(entry.path());
    }
    if (found.size() != 1) {
      throw SetupError({.key = "merge",
                        .found = part.string() + " with " + std::to_string(found.size()) + " JSON files",
                        .expected = "folders with one part of a study each"});
    }
    files.push_back(found.front());
  }
  if (files.empty()) throw SetupError({.key = "merge", .found = "no folder", .expected = "folders with parts"});
  json about = read_json(files.front());
  const Study& study = study_named(about.at("study").get<std::string>());
  Options options;
  options.seed = about.at("seed").get<std::uint64_t>();
  options.quick = about.value("quick", false);
  if (about.contains("asked_runs")) options.runs = about.at("asked_runs").get<double>();
  Table table(study.columns());
  for (const fs::path& file : files) {
    const json other = read_json(file);
    for (const char* key : {"study", "seed", "quick", "jobs", "asked_runs", "version"}) {
      if (other.value(key, json()) != about.value(key, json())) {
        throw SetupError({.file = file.string(),
                          .key = key,
                          .found = other.value(key, json()).dump(),
                          .expected = about.value(key, json()).dump() + ", as in " + files.front().string()});
      }
    }
    table.read_csv(fs::path(file).replace_extension(".csv"));
  }
  // Each job may occur once. All rows of a job are from one part, so they are next to each other.
  std::set<std::size_t> seen;
  std::size_t previous = static_cast<std::size_t>(-1);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.job(row) == previous) continue;
    previous = table.job(row);
    if (!seen.insert(previous).second) {
      throw SetupError(
          {.key = "merge", .found = "job " + std::to_string(previous) + " twice", .expected = "each part once"});
    }
  }
  if (seen.size() != study.jobs(options)) {
    throw SetupError({.key = "merge",
                      .found = std::to_string(seen.size()) + " jobs",
                      .expected = std::to_string(study.jobs(options)) + " jobs: all parts"});
  }
  about.erase("shard");
  make_folder(out);
  return finish(study, options, table, about, out);
}

}  // namespace proxarm::studies
