// Turns each cause that would end the session from outside into a controlled stop: every catchable signal that would
// end or suspend the process, a lost terminal, and a standard output or error without a reader.
//
// SIGKILL and SIGSTOP aren't caught, because no process can catch them. The signals of a crash (SIGSEGV, SIGBUS,
// SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS) aren't caught, because after a crash only the drives' own watchdogs can be
// trusted. SIGPIPE, SIGTTIN and SIGTTOU are ignored: without them a write fails, and the watch finds why. SIGHUP stays
// ignored under nohup.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace proxarm::controller {

struct EndingCause {
  std::string word = "signal";  // for programs: "signal", "output_closed" or "terminal_lost"
  std::string text;             // for people, such as "SIGHUP"; empty: no cause yet
};

class SignalWatch {
 public:
  // Starts the watch. Until the destructor returns, `on_ending` is called once per cause, in the watch's thread. Only
  // one watch may exist at a time.
  explicit SignalWatch(std::function<void()> on_ending);
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch();  // restores the signals' actions, except that SIGPIPE stays ignored

  // Returns the first cause. Any thread may call it.
  [[nodiscard]] EndingCause cause() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Makes the process ignore all signals that the watch handles, so that the process can still report the session's end.
void ignore_ending_signals() noexcept;

}  // namespace proxarm::controller
