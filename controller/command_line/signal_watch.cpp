#include "controller/command_line/signal_watch.hpp"

#include <csignal>
#include <thread>
#include <utility>  // before Asio 1.74, which forgets it

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

namespace proxarm::command_line {

struct SignalWatch::State {
  boost::asio::io_context context;
  boost::asio::signal_set signals{context, SIGINT, SIGTERM};
  std::function<void(int)> on_signal;
  std::thread thread;

  void wait() {
    signals.async_wait([this](const boost::system::error_code& error, int signal) {
      if (error) return;
      on_signal(signal);
      wait();
    });
  }
};

SignalWatch::SignalWatch(std::function<void(int signal)> on_signal) : state_(std::make_unique<State>()) {
  state_->on_signal = std::move(on_signal);
  state_->wait();
  state_->thread = std::thread([this] { state_->context.run(); });
}

SignalWatch::~SignalWatch() {
  state_->context.stop();
  state_->thread.join();
}

}  // namespace proxarm::command_line
