#include "controller/command_line/sessions/view_process.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>

#include "controller/command_line/entry/child_process.hpp"
#include "controller/live/control_socket.hpp"
#include "controller/live/signal_watch.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::Json;
using description::SetupError;

constexpr int answer_within_ms = 30'000;  // loading a mesh that isn't cached may take long
// The descriptors' numbers in the view's process.
constexpr int memory_there = 3, line_there = 4;

[[noreturn]] void refuse(const std::string& found, const std::string& expected, const std::string& advice = "") {
  throw SetupError({.key = "--view", .found = found, .expected = expected, .advice = advice});
}

// Returns the file's path. Throws SetupError if the file can be read only once, because the view's process reads the
// files again.
std::string readable_twice(const fs::path& file, const char* option) {
  std::error_code error;
  if (!file.empty() && !fs::is_regular_file(file, error)) {
    throw SetupError({.key = option,
                      .found = description::in_quotes(file.string()) + ", which can be read only once",
                      .expected = "a file, where --view is given",
                      .advice = "write it to a file first"});
  }
  return file.empty() ? "" : fs::absolute(file).lexically_normal().string();
}

Json hello_of(const controller::PreparedSession& session, const controller::RunOptions& options,
              ViewProcess::Shows shows) {
  const bool arm_alone = shows == ViewProcess::Shows::simulated_arm;
  const controller::SessionSettings& settings = session.settings;
  fs::path control;
  if (options.view_control)
    control = options.control == "default" ? controller::default_control_path() : options.control;
  return {{"cell", readable_twice(session.cell.file, "cell")},
          {"scene", arm_alone && options.scene.empty() ? "" : readable_twice(session.scene.file, "--scene")},
          {"tool", session.scene.tool ? readable_twice(session.scene.tool->file, "--tool") : ""},
          {"arm_alone", arm_alone},
          {"control", control.empty() ? "" : fs::absolute(control).string()},
          {"port", options.view_port},
          {"allowed_origins", options.allowed_origins},
          {"settings",
           {{"period_s", settings.period_s},
            {"mass_kg", settings.mass_kg},
            {"damping_Ns_per_m", settings.damping_Ns_per_m},
            {"spring_N_per_m", settings.spring_N_per_m},
            {"impedance", session.impedance()}}}};
}

// Sends a value as one line of JSON. Returns false if the reader is gone.
bool send_line(int line, const Json& value) {
  const std::string text = value.dump() + "\n";
  return send(line, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
}

// Returns the next line; empty if no line comes within answer_within_ms.
std::string read_line(int line) {
  std::string text;
  for (char letter = 0; letter != '\n'; text += letter) {
    pollfd ready{line, POLLIN, 0};
    const int polled = poll(&ready, 1, answer_within_ms);
    if (polled < 0 && errno == EINTR) continue;
    if (polled <= 0 || read(line, &letter, 1) != 1) return "";
  }
  return text;
}

}  // namespace

void tell_margin(const controller::ViewPlace& place, const controller::PassedPoses::Place& judged) {
  const Json told{{"margin",
                   {{"time_s", judged.time_s},
                    {"felt_mass_kg", judged.felt_mass_kg},
                    {"smallest_stable_mass_kg", judged.smallest_stable_mass_kg}}}};
  const std::string text = told.dump() + "\n";
  (void)send(place.line, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

fs::path view_control_path() {
  return controller::default_control_path().parent_path() / ("view-" + std::to_string(getpid()));
}

void remove_view_control() {
  unlink(view_control_path().c_str());
  unlink((view_control_path().string() + ".lock").c_str());
}

ViewProcess::ViewProcess(const controller::PreparedSession& session, const controller::RunOptions& options, int memory,
                         Shows shows) {
  start(memory);
  try {
    greet(session, options, shows);
  } catch (...) {
    close(line_);
    waitpid(child_, nullptr, 0);
    throw;
  }
  std::fprintf(stderr, "proxarm: the view of this %s: %s\n", shows == Shows::session ? "session" : "arm", url_.c_str());
  if (!options.json) door_.emplace(url_);
}

void ViewProcess::start(int memory) {
  const fs::path program = fs::read_symlink("/proc/self/exe").replace_filename("proxarm-view");
  std::error_code error;
  if (!fs::exists(program, error)) {
    refuse("no program " + program.string(), "it beside proxarm", "in a source tree `./dev run --view` builds it");
  }
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    refuse(std::strerror(errno), "a free file descriptor", "see ulimit -n");
  }
  const ChildProcess child =
      start_child({program.string(), "--live", std::to_string(memory_there), std::to_string(line_there)},
                  {memory, ends[1]}, ErrorStream::shared);
  child_ = child.id;
  close(ends[1]);
  line_ = ends[0];
  if (child.error != 0) {
    refuse(program.string() + ": " + std::strerror(child.error), "a program that can be started");
  }
}

void ViewProcess::greet(const controller::PreparedSession& session, const controller::RunOptions& options,
                        Shows shows) {
  send_line(line_, hello_of(session, options, shows));
  const Json answer = Json::parse(read_line(line_)).value_or(Json());
  if (const auto url = answer.text_of("url")) {
    url_ = *url;
    place_ = {static_cast<std::uint16_t>(answer.integer_of("port").value_or(0)),
              static_cast<std::size_t>(answer.integer_of("most_viewers").value_or(0)), line_};
    return;
  }
  if (const auto error = answer.text_of("error")) throw SetupError({.message = *error});
  refuse("no answer of the view", "its address");
}

void ViewProcess::show_end(int exit_status) {
  if (!send_line(line_, {{"ended", "the session is over"}, {"exit_status", exit_status}})) return;
  std::atomic<bool> asked{false};
  controller::SignalWatch signals([&] { asked.store(true); });  // before the message offers Ctrl-C
  std::fprintf(stderr, "proxarm: the session is over; its view stays at %s until Ctrl-C\n", url_.c_str());
  while (!asked.load() && waitpid(child_, nullptr, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

ViewProcess::~ViewProcess() {
  close(line_);
  if (child_ > 0) waitpid(child_, nullptr, 0);
}

}  // namespace proxarm::command_line
