// Whatever asks a session to end from outside, turned into a controlled stop: every signal that would end or suspend
// the process and can be caught, a terminal that is gone, and a standard output or error that nobody reads any more.
//
// Not caught: SIGKILL and SIGSTOP, which can't be, and the signals of a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL,
// SIGABRT, SIGTRAP, SIGSYS), after which nothing of this process is to be trusted: the drives' own watchdogs stop the
// arm. SIGPIPE, SIGTTIN and SIGTTOU are ignored: writing fails instead, and the watch sees why. SIGHUP stays ignored
// where the session was started with nohup, which asks for that.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace proxarm::command_line {

struct EndingCause {
  std::string word = "signal";  // for programs: "signal", "output_closed", "terminal_lost"
  std::string text;             // for people: "SIGHUP", "standard output was closed"; empty: nothing has come
};

class SignalWatch {
 public:
  // `on_ending` runs in the watch's own thread, once per cause, until the destructor returns. One watch at a time.
  explicit SignalWatch(std::function<void()> on_ending);
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch();  // signals act as before, but for SIGPIPE, which stays ignored

  // Any thread: what came first.
  [[nodiscard]] EndingCause cause() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// For a process that outlives the session's end to tell of it: none of the above ends or suspends it.
void ignore_ending_signals() noexcept;

}  // namespace proxarm::command_line
