// Turns outside requests to end the session into a controlled stop: every catchable signal that would end or suspend
// the process, a lost terminal, and a standard output or error without a reader.
//
// Not caught: SIGKILL and SIGSTOP, which can't be, and the signals of a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL,
// SIGABRT, SIGTRAP, SIGSYS), after which only the drives' own watchdogs can be trusted. SIGPIPE, SIGTTIN and SIGTTOU
// are ignored: writing fails instead, and the watch finds the cause. SIGHUP stays ignored under nohup.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace proxarm::command_line {

struct EndingCause {
  std::string word = "signal";  // for programs: "signal", "output_closed", "terminal_lost"
  std::string text;             // for people: "SIGHUP", "standard output was closed"; empty: no cause yet
};

class SignalWatch {
 public:
  // `on_ending` runs in the watch's thread, once per cause, until the destructor returns. Only one watch may exist.
  explicit SignalWatch(std::function<void()> on_ending);
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch();  // restores the signals' actions, except for SIGPIPE, which stays ignored

  // Returns the first cause. Any thread may call it.
  [[nodiscard]] EndingCause cause() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// After this call none of these signals ends or suspends the process, so that it can still report the session's end.
void ignore_ending_signals() noexcept;

}  // namespace proxarm::command_line
