#include "controller/command_line/entry/command_app.hpp"

#include <cstdio>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/options/parsing/option_parsing.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::command_line {

CommandApp::CommandApp(const std::string& version)
    : app_("Hold an industrial robot arm and feel a virtual world through it.", "proxarm") {
  app_.require_subcommand(1);
  app_.set_version_flag("--version", "proxarm " + version);
  app_.formatter(std::make_shared<HelpFormatter>());
  app_.set_help_all_flag("--help-all", "help of all commands of this program");
}

CLI::App* CommandApp::add(const std::string& name, const std::string& text, std::function<int()> command) {
  CLI::App* added = app_.add_subcommand(name, text);
  added->callback([this, command = std::move(command)] { chosen_ = command; });
  return added;
}

void CommandApp::add_line(const std::string& name, const std::string& text) { app_.add_subcommand(name, text); }

int CommandApp::run(int argc, char** argv) {
  controller::refuse_options_as_values(app_);
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app_.exit(error, std::cout, std::cerr);  // help, version
    if (app_.get_subcommands().empty()) return refuse_command(argc > 1 ? argv[1] : "");
    const CLI::App& command = *app_.get_subcommands().front();
    return refuse_options(command, "proxarm " + command.get_name(), {argv + 2, argv + argc}, error);
  }
  return chosen_();
}

int CommandApp::refuse_command(const std::string& word) const {
  std::vector<std::string> commands;
  for (const CLI::App* command : app_.get_subcommands({})) commands.push_back(command->get_name());
  std::string message = (word.empty() ? "found no command" : "found " + description::in_quotes(word)) + ", expected " +
                        description::one_of(commands);
  const std::string near = description::nearest(word, commands);
  if (!near.empty()) message += "; did you mean " + near + "?";
  std::fprintf(stderr, "proxarm: %s; see proxarm --help\n", message.c_str());
  return set_up_mistake;
}

}  // namespace proxarm::command_line
