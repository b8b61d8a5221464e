// A program of ours around its commands.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::command_line {

// What `main` returns: opens the standard descriptors, runs, says in one line what went wrong, and hands over what was
// printed.
int run_program(const std::function<int()>& run) noexcept;

// Prints options_mistake(). `called` is how the command was called, such as "proxarm run". Returns the exit status.
int refuse_options(const CLI::App& command, const std::string& called, const std::vector<std::string>& words,
                   const CLI::ParseError& error);

// The options of a program that is one command and bears its name, such as "proxarm study". The exit status where there
// is nothing left to do: after --help, or options that are refused.
std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv);

}  // namespace proxarm::command_line
