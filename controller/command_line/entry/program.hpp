// The frame around each of the project's programs: runs a command and reports its errors.
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

// Prints options_mistake() as one line. `called` is the command as the user typed it, such as "proxarm run". Returns
// the exit status.
int refuse_options(const CLI::App& command, const std::string& called, const std::vector<std::string>& words,
                   const CLI::ParseError& error);

// Parses the options of a single-command program such as "proxarm study". Returns the exit status if the program is
// done: after --help, or if options were refused.
std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv);

}  // namespace proxarm::command_line
