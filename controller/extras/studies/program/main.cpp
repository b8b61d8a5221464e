// Defines the program that `proxarm study` becomes. It is a separate program because the studies take a sixth of
// proxarm's compile time.
//
// Exit status: 0: fine; 1: an invariant was violated; 2: set-up mistake.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/entry/separate_commands.hpp"
#include "controller/extras/studies/program/study_command.hpp"
#include "controller/options/parsing/option_parsing.hpp"

namespace {

using namespace proxarm;
using command_line::StudyOptions;
using controller::whole_number;

void add_study_options(CLI::App& app, StudyOptions& options) {
  app.add_option("study", options.words,
                 "figure5, stress, stress_meshes, stress_layers, stress_order2, stress_tools, stress_moving, error, "
                 "error_tools, stability, fidelity or skip; or merge and the folders of its parts")
      ->type_name("NAME")
      ->required();
  app.add_option("--out", options.out, "folder for CSV, JSON and plots")->type_name("DIR");
  app.add_flag("--quick", options.quick, "fewer and coarser runs");
  app.add_option("--seed", whole_number("--seed", [&](std::uint64_t n) { options.seed = n; }),
                 "of all that is random (default 1)")
      ->type_name("N");
  app.add_option("--runs", whole_number("--runs", [&](std::uint64_t n) { options.runs = static_cast<double>(n); }),
                 "how many, in studies of random runs")
      ->type_name("N");
  app.add_option("--shard", options.shard, "do the I-th of N parts")->type_name("I/N");
  app.add_option("--threads",
                 whole_number("--threads", [&](std::uint64_t n) { options.threads = static_cast<unsigned>(n); }),
                 "how many (default: one per core)")
      ->type_name("N");
  app.add_option("--replay", whole_number("--replay", [&](std::uint64_t n) { options.replay = n; }),
                 "stress and its kin: one run again, by the seed that was printed for it")
      ->type_name("SEED");
}

int run(int argc, char** argv) {
  CLI::App app{command_line::text_of("study"), "proxarm study"};
  app.formatter(std::make_shared<command_line::HelpFormatter>());
  StudyOptions options;
  options.command_line = "proxarm study";
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (const std::string& word : words) options.command_line += " " + word;
  add_study_options(app, options);
  const std::string description = words.empty() ? "" : command_line::study_description(words.front());
  if (!description.empty()) app.description(description);
  if (const auto status = command_line::parse_options(app, argc, argv)) return *status;
  return command_line::study_command(options);
}

}  // namespace

int main(int argc, char** argv) {
  return command_line::run_program([&] { return run(argc, argv); });
}
