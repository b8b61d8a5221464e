// SIGINT and SIGTERM, turned into a controlled stop: a thread of Boost.Asio that waits for them.
#pragma once

#include <functional>
#include <memory>

namespace proxarm::command_line {

class SignalWatch {
 public:
  // `on_signal` runs in the watch's own thread, once per signal, until the destructor returns.
  explicit SignalWatch(std::function<void(int signal)> on_signal);
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace proxarm::command_line
