// Defines the program behind `--view` and `proxarm view`. It is a separate program, so that a session has no web server
// in its memory.
//
// Exit status: 0: fine; 2: set-up mistake.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/extras/view/program/live_view.hpp"
#include "controller/extras/view/program/play_view.hpp"
#include "controller/options/parsing/option_parsing.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"

namespace {

using namespace proxarm;

command_line::PictureSize parse_size(const std::string& text) {
  command_line::PictureSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) == 2 && size.width >= 200 &&
      size.height >= 200 && size.width <= 8000 && size.height <= 8000) {
    return size;
  }
  throw description::SetupError({.key = "--size",
                                 .found = description::in_quotes(text),
                                 .expected = "WIDTHxHEIGHT in pixels, 200 to 8000 each, such as 1280x720"});
}

void add_picture_options(CLI::App& app, command_line::ViewOptions& options) {
  app.add_option("--snapshot", CLI::callback_t([&](const CLI::results_t& words) {
                   for (const std::string& word : words) {
                     options.snapshots_s.push_back(description::parse_duration(word, "--snapshot"));
                   }
                   return true;
                 }),
                 "a picture instead, of this time in the record, such as 4.5s, drawn by a Chromium without a window; "
                 "may be repeated")
      ->type_name("TIME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--out", options.out, "the picture's file, which ends in .png; of several with a number before that")
      ->type_name("FILE");
  app.add_option("--size", CLI::callback_t([&](const CLI::results_t& words) {
                   options.size = parse_size(words.back());
                   return true;
                 }),
                 "of the picture (default 1280x720)")
      ->type_name("WxH");
  app.add_option("--look",
                 controller::choice<std::string>(
                     "--look",
                     {{"overview", "overview"}, {"tool", "tool"}, {"top", "top"}, {"front", "front"}, {"side", "side"}},
                     [&](const std::string& value) { options.look = value; }),
                 "from where (default overview)")
      ->type_name("VIEW");
  app.add_flag("--dark", options.dark, "a dark picture");
}

void require_picture(const command_line::ViewOptions& options) {
  if (options.snapshots_s.empty() == options.out.empty() &&
      (options.out.empty() || options.out.extension() == ".png")) {
    return;
  }
  throw description::SetupError({.key = "--out",
                                 .found = options.out.empty() ? "none" : description::in_quotes(options.out.string()),
                                 .expected = "--snapshot TIME and --out FILE.png, or neither"});
}

void add_options(CLI::App& app, command_line::ViewOptions& options) {
  app.add_option("folder", options.folder, "folder of --record, or of a black box")->required()->type_name("DIR");
  app.add_option("--port",
                 controller::whole_number("--port",
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
  add_picture_options(app, options);
}

int run(const std::vector<std::string>& words, char** argv) {
  // A session starts the program with these words (sessions/view_process.cpp).
  if (words.size() == 3 && words[0] == "--live") {
    return command_line::live_view(std::atoi(words[1].c_str()), std::atoi(words[2].c_str()));
  }
  CLI::App app{"a recorded session or a black box in the browser: scrub, slow down, step, jump to what happened",
               "proxarm view"};
  app.formatter(std::make_shared<command_line::HelpFormatter>());
  command_line::ViewOptions options;
  add_options(app, options);
  if (const auto status = command_line::parse_options(app, static_cast<int>(words.size()) + 1, argv)) return *status;
  require_picture(options);
  return command_line::play_view(options);
}

}  // namespace

int main(int argc, char** argv) {
  return command_line::run_program([&] { return run({argv + 1, argv + argc}, argv); });
}
