#include "controller/extras/studies/program/study_command.hpp"

#include <algorithm>
#include <cstdio>

#include "controller/extras/studies/program/arm_run.hpp"
#include "controller/extras/studies/stress/stress.hpp"
#include "controller/extras/studies/studies.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

constexpr int found_something = 1;

void require(bool holds, const char* option, const char* found, const char* expected) {
  if (!holds) throw description::SetupError({.key = option, .found = found, .expected = expected});
}

struct StudyText {
  const char* name;
  const char* text;
};

constexpr StudyText study_texts[] = {
    {"figure5",
     "The paper's experiment: a light impedance-type device is pressed onto a wall with friction, rubbed along it and "
     "pulled away, by (1), (5) and (23). Writes figure5.csv (force and motion), figure5.json (pull on leaving, kick, "
     "oscillation) and plots. Nothing in it is random: --seed and --runs have no effect."},
    {"error",
     "Error against run time of ten motions with exact solutions: (26), order 2, penalty contact and the rule of "
     "common admittance controllers. Writes error.csv (every run), error.json (orders of convergence) and plots. It "
     "measures time: leave the machine alone meanwhile. Nothing in it is random."},
    {"error_tools",
     "Errors of (26) of a rigid tool by timestep, on six motions with exact solutions, and what a step takes. Writes "
     "error_tools.csv, error_tools.json (orders of convergence) and a plot. It measures time: leave the machine alone "
     "meanwhile. Nothing in it is random."},
    {"stability",
     "The smallest stable mass over timestep, hand, delay, drive and order: by eigenvalues and by simulation. Writes "
     "stability.csv, stability.json (how far they agree) and plots. Nothing in it is random."},
    {"fidelity",
     "What the hand feels at the simulated arm from 0.1 to 30 Hz, in free motion, on a wall and of a tool that it "
     "turns. Writes fidelity.csv, fidelity.json and plots. Nothing in it is random."},
    {"skip",
     "The cost of a step and of start-up against the size of a world, and how often cycles can leave something out. "
     "Writes skip.csv, skip.json and a plot. It "
     "measures "
     "time: leave the machine alone meanwhile. Nothing in it is random."},
    {"stress",
     "Random worlds, invariants at every step: finite, never inside, no pull, within the friction cone, independent of "
     "K, no work made. Writes stress.csv (every run), stress.json and a plot. Status 1: an invariant was violated; its "
     "seed is printed, for --replay. Default: 1,000,000 runs, 1000 with --quick."},
    {"stress_meshes", "The same as stress, among concave meshes and meshes that move."},
    {"stress_layers", "The same as stress, among objects with elastic layers."},
    {"stress_order2", "The same worlds as stress, all of them by order 2."},
    {"stress_tools",
     "Random rigid tools among planes, solids and in hollow objects: the invariants of stress for poses, and no energy "
     "made beyond what is of second order in a step."},
    {"stress_moving", "The same as stress_tools, among objects that move; the work that they do is taken off."},
    {"merge", "Joins the parts of a study (--shard) in the named folders to the files of one run, in --out."},
};

}  // namespace

std::string study_description(const std::string& name) {
  for (const StudyText& study : study_texts) {
    if (name == study.name) return study.text;
  }
  return "";
}

int study_command(const StudyOptions& options) {
  const studies::StudyList list = studies::all_studies(run_arm, count_cycles);
  const std::string& name = options.words.front();
  if (options.replay) {
    const auto& known = studies::Stress::worlds_names;
    const auto which = std::find(known.begin(), known.end(), name);
    require(which != known.end() && options.words.size() == 1, "--replay", "another study",
            "study stress --replay SEED, or stress_meshes, stress_layers, stress_order2, stress_tools, stress_moving");
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
