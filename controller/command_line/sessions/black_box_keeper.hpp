// Writes the black box from a separate process, the keeper, when a session ends in a fault or crashes.
//
// The keeper is forked before the session opens files or starts threads. It shares the box's memory, and sleeps until
// its pipe reports the session's end or closes. A signal handler in the session's own process couldn't replace it:
// after a crash the handler could make only async-signal-safe calls, on a damaged stack and heap, and no handler sees
// SIGKILL. The cycle does no work for the keeper.
#pragma once

#include <filesystem>
#include <string>

#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "controller/record/replay_log.hpp"

namespace proxarm::command_line {

class BlackBoxKeeper {
 public:
  // Preconditions: `session` and `options` outlive this object; no other thread runs yet. Throws SetupError if
  // --black-box names an unusable folder.
  BlackBoxKeeper(const controller::PreparedSession& session, const controller::RunOptions& options);
  BlackBoxKeeper(const BlackBoxKeeper&) = delete;
  BlackBoxKeeper& operator=(const BlackBoxKeeper&) = delete;
  ~BlackBoxKeeper();  // the keeper writes the box, unless finish() was called

  [[nodiscard]] controller::BlackBox& box() noexcept { return box_; }
  // Sets which buses the session is on. Call it before the first cycle.
  void set_head(const controller::ReplayHead& head) noexcept;
  [[nodiscard]] const controller::ReplayHead& head() const noexcept;
  // Tells the keeper that the session has ended. `reason` names the session's fault; empty: no fault. After a fault,
  // waits until the keeper has written the box or has printed an error on standard error. Returns whether the box was
  // written.
  bool finish(const std::string& reason);
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  struct Shared;
  void start();
  [[noreturn]] void keep(int said);
  void write(const std::string& reason) const;

  const controller::PreparedSession& session_;
  std::filesystem::path folder_;
  controller::BlackBox box_;
  Shared* shared_;  // in memory shared with the keeper's process
  int say_ = -1;
  int child_ = -1;
};

}  // namespace proxarm::command_line
