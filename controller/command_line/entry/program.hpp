// Runs a command of one of the project's programs and reports the command's errors.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::command_line {

// Returns the exit status for `main`. Opens the standard descriptors, calls `run`, prints an error as one line, and
// flushes standard output.
int run_program(const std::function<int()>& run) noexcept;

// Prints options_mistake(). `called` is the command as the user typed it, such as "proxarm run". Returns
// the exit status.
int refuse_options(const CLI::App& command, const std::string& called, const std::vector<std::string>& words,
                   const CLI::ParseError& error);

// Parses the options of a single-command program such as "proxarm study". Returns the exit status if the program ends
// here: after --help, or if options were refused. Otherwise returns nullopt.
std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv);

}  // namespace proxarm::command_line
