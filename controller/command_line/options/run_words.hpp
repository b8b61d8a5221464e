// The one table of what `proxarm run` takes: for the program, and for programs of one's own (controller/library), which
// have the same words without a command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/run_options.hpp"

namespace CLI {
class App;
}

namespace proxarm::command_line {

// All of them. `app` and `options` must outlive the parsing.
void add_run_options(CLI::App& app, RunOptions& options);

// What these words ask for, such as {"--mass=4kg", "--no-plot"}. Throws SetupError with the words of the program.
RunOptions run_options(const std::vector<std::string>& words);

// What an option takes, as its help names it: "TIME", "auto|off|TIME"; empty: it is a flag. `name` is "--mass" or, of
// the file without one, "cell". Nothing: there is no such option.
std::optional<std::string> run_option_type(const std::string& name);

}  // namespace proxarm::command_line
