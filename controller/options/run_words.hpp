// The one table of the options of `proxarm run`: for the program, and for the library (controller/library), which
// parses the same words without a command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/preparation/run_options.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace proxarm::controller {

// Adds all options. Precondition: `app` and `options` outlive the parsing.
void add_run_options(CLI::App& app, RunOptions& options);

// Parses words such as {"--mass=4kg", "--no-plot"}. Throws SetupError with the program's message.
RunOptions run_options(const std::vector<std::string>& words);

// Returns the value's type as in the help: "TIME", "auto|off|TIME"; empty for a flag; nothing for an unknown option.
// `name` is "--mass", or "cell" for the positional argument.
std::optional<std::string> run_option_type(const std::string& name);

}  // namespace proxarm::controller
