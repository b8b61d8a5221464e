// Lays out the help of commands: names on the left, wrapped descriptions on the right.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace proxarm::command_line {

inline constexpr std::size_t help_columns = 100;

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_description(const CLI::App* app) const override;
};

}  // namespace proxarm::command_line
