// The program behind `--view` and `proxarm view`: apart, so that nothing of a web server is in the memory of a session.
//
// Exit status: 0 fine, 2 set-up mistake.
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/options.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/view/live_view.hpp"
#include "controller/command_line/view/play_view.hpp"
#include "models/base/setup_error.hpp"

namespace {

using namespace proxarm;

void add_options(CLI::App& app, command_line::ViewOptions& options) {
  app.add_option("folder", options.folder, "folder of --record, or of a black box")->required()->type_name("DIR");
  app.add_option("--port",
                 command_line::whole_number("--port",
                                            [&](std::uint64_t port) {
                                              if (port < 1024 || port > 65535) {
                                                throw description::SetupError({.key = "--port",
                                                                               .found = std::to_string(port),
                                                                               .expected = "1024 to 65535"});
                                              }
                                              options.port = static_cast<std::uint16_t>(port);
                                            }),
                 "on 127.0.0.1 (default: any that is free)")
      ->type_name("PORT");
}

int run(const std::vector<std::string>& words, char** argv) {
  // As a session starts it (sessions/view_process.cpp).
  if (words.size() == 3 && words[0] == "--live") {
    return command_line::live_view(std::atoi(words[1].c_str()), std::atoi(words[2].c_str()));
  }
  CLI::App app{"a recorded session or a black box in the browser: scrub, slow down, step, jump to what happened",
               "proxarm view"};
  app.formatter(std::make_shared<command_line::HelpFormatter>());
  command_line::ViewOptions options;
  add_options(app, options);
  try {
    app.parse(static_cast<int>(words.size()) + 1, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error, std::cout, std::cerr);
    return command_line::refuse_options(app, "proxarm view", words, error);
  }
  return command_line::play_view(options);
}

}  // namespace

int main(int argc, char** argv) {
  return command_line::run_program([&] { return run({argv + 1, argv + argc}, argv); });
}
