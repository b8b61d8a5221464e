#include <algorithm>
#include <cstdio>

#include "controller/command_line/arm_run.hpp"
#include "controller/command_line/commands.hpp"
#include "controller/studies/stress.hpp"
#include "controller/studies/studies.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::command_line {
namespace {

constexpr int found_something = 1;

void require(bool holds, const char* option, const char* found, const char* expected) {
  if (!holds) throw description::SetupError({.key = option, .found = found, .expected = expected});
}

}  // namespace

int study_command(const StudyOptions& options) {
  const studies::StudyList list = studies::all_studies(run_arm);
  const std::string& name = options.words.front();
  if (options.replay) {
    const auto& known = studies::Stress::worlds_names;
    const auto which = std::find(known.begin(), known.end(), name);
    require(which != known.end() && options.words.size() == 1, "--replay", "another study",
            "study stress --replay SEED, or stress_meshes, stress_layers");
    std::string text;
    const auto worlds = static_cast<studies::Stress::Worlds>(which - known.begin());
    const bool violated = studies::Stress::replay(*options.replay, text, worlds);
    std::printf("%s", text.c_str());
    return violated ? found_something : 0;
  }
  require(!options.out.empty(), "--out", "nothing", "a folder for CSV, JSON and plots");
  studies::Outcome outcome;
  if (name == "merge") {
    const std::vector<std::filesystem::path> parts(options.words.begin() + 1, options.words.end());
    outcome = studies::merge_study(
        [&](const std::string& named) -> const studies::Study& { return studies::study_named(list, named); }, parts,
        options.out);
  } else {
    const studies::Study& study = studies::study_named(list, name);
    require(options.words.size() == 1, "study", "more than one name", "one study, or merge and folders");
    outcome =
        studies::run_study(study, {options.quick, options.seed, options.runs}, studies::Shard::parse(options.shard),
                           options.out, options.command_line, options.threads);
  }
  std::printf("%s", outcome.text.c_str());
  for (const std::string& warning : outcome.warnings) std::fprintf(stderr, "proxarm: %s\n", warning.c_str());
  return outcome.failed ? found_something : 0;
}

}  // namespace proxarm::command_line
