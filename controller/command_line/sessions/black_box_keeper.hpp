// Who writes the black box when a session ends in a fault, or ends by dying: a process of its own.
//
// It is forked off before the session opens anything and starts a thread, shares the box's memory, and sleeps until its
// end of a pipe says how the session ended, or falls shut without a word. A signal handler would have to do with what
// is async-signal-safe, with the stack and heap that the crash has left, and never sees SIGKILL; a process that isn't
// ill itself writes files in the ordinary way, whatever the session died of. It costs the cycle nothing.
#pragma once

#include <filesystem>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "controller/record/replay_log.hpp"

namespace proxarm::command_line {

class BlackBoxKeeper {
 public:
  // `session` and `options` must outlive it. No other thread may run yet. Throws SetupError where --black-box names a
  // folder that can't be used.
  BlackBoxKeeper(const PreparedSession& session, const RunOptions& options);
  BlackBoxKeeper(const BlackBoxKeeper&) = delete;
  BlackBoxKeeper& operator=(const BlackBoxKeeper&) = delete;
  ~BlackBoxKeeper();  // the box is written, unless finish() said otherwise

  [[nodiscard]] controller::BlackBox& box() noexcept { return box_; }
  // Which buses the session turned out to be on; before the first cycle.
  void set_head(const controller::ReplayHead& head) noexcept;
  [[nodiscard]] const controller::ReplayHead& head() const noexcept;
  // The session is over. With a fault, named by `reason`, the box is written before this returns, or a line on standard
  // error says why not. True: it was written.
  bool finish(const std::string& reason);
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  struct Shared;
  void start();
  [[noreturn]] void keep(int said);
  void write(const std::string& reason) const;

  const PreparedSession& session_;
  std::filesystem::path folder_;
  controller::BlackBox box_;
  Shared* shared_;  // as the box's memory
  int say_ = -1;
  int child_ = -1;
};

}  // namespace proxarm::command_line
