// The command line of a program that has several commands, such as `proxarm run` and `proxarm check`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace proxarm::command_line {

class CommandApp {
 public:
  explicit CommandApp(const std::string& version);
  CommandApp(const CommandApp&) = delete;
  CommandApp& operator=(const CommandApp&) = delete;

  // Adds a command with its line in the help; returns it, so that its options can be added. `command` returns the exit
  // status.
  CLI::App* add(const std::string& name, const std::string& text, std::function<int()> command);

  // Adds the help's line of a command that another program carries out.
  void add_line(const std::string& name, const std::string& text);

  // Parses the words, and runs the command that the user chose. Returns its exit status, or after mistakes in the words
  // set_up_mistake.
  int run(int argc, char** argv);

 private:
  int refuse_command(const std::string& word) const;

  CLI::App app_;
  std::function<int()> chosen_;
};

}  // namespace proxarm::command_line
