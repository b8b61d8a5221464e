#include "controller/command_line/entry/program.hpp"

#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/command_line/entry/standard_streams.hpp"
#include "controller/options/parsing/option_parsing.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

int run_program(const std::function<int()>& run) noexcept {
  open_standard_descriptors();
  try {
    return flush_standard_output(run());
  } catch (const description::SetupError& error) {
    std::fprintf(stderr, "proxarm: %s\n", error.what());
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "proxarm: out of memory; see ulimit -v, or give a smaller scene or mesh\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "proxarm: %s\n", error.what());
  }
  return set_up_mistake;
}

int refuse_options(const CLI::App& command, const std::string& called, const std::vector<std::string>& words,
                   const CLI::ParseError& error) {
  std::fprintf(stderr, "proxarm: %s; see %s --help\n", controller::options_mistake(command, words, error).c_str(),
               called.c_str());
  return set_up_mistake;
}

std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv) {
  controller::refuse_options_as_values(app);
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error, std::cout, std::cerr);
    return refuse_options(app, app.get_name(), {argv + 1, argv + argc}, error);
  }
}

}  // namespace proxarm::command_line
