#include "controller/live/signal_watch.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

// Returns the signals that by default end the process or (SIGTSTP) suspend it.
std::vector<int> ending_signals() {
  std::vector<int> all{SIGHUP,  SIGINT,  SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,   SIGALRM, SIGVTALRM,
                       SIGPROF, SIGXCPU, SIGXFSZ, SIGPOLL, SIGPWR,  SIGSTKFLT, SIGTSTP};
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) all.push_back(signal);
  return all;
}
constexpr std::array ignored_signals{SIGPIPE, SIGTTIN, SIGTTOU};

constexpr unsigned char end_of_watch = 0;  // no signal has this number

// The pipe's end to which the signal handler writes the signal's number. It is atomic because the handler must be
// async-signal-safe.
std::atomic<int> wake_up{-1};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void note_signal(int signal) {
  const int saved = errno;
  const auto number = static_cast<unsigned char>(signal);
  // If the pipe is full and the write fails, an earlier signal has already asked for the stop.
  [[maybe_unused]] const ssize_t written = write(wake_up.load(std::memory_order_relaxed), &number, 1);
  errno = saved;
}

std::string name_of(int signal) {
  const char* const name = sigabbrev_np(signal);
  return name != nullptr ? std::string("SIG") + name : "signal " + std::to_string(signal);
}

struct Output {
  int descriptor;
  EndingCause lost;
};

// Returns the outputs to watch, and standard input if it is a terminal. Another standard input isn't watched: the end
// of a pipe isn't a loss.
std::vector<Output> watched_outputs() {
  std::vector<Output> outputs;
  const EndingCause terminal{"terminal_lost", "the terminal was lost"};
  if (isatty(STDIN_FILENO) == 1) outputs.push_back({STDIN_FILENO, terminal});
  const auto add = [&](int descriptor, const char* closed) {
    if (fcntl(descriptor, F_GETFD) == -1) return;
    outputs.push_back({descriptor, isatty(descriptor) == 1 ? terminal : EndingCause{"output_closed", closed}});
  };
  add(STDOUT_FILENO, "standard output was closed");
  add(STDERR_FILENO, "standard error was closed");
  return outputs;
}

void handle(int signal, void (*handler)(int), struct sigaction* before) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigfillset(&action.sa_mask);
  sigaction(signal, &action, before);
}

}  // namespace

struct SignalWatch::State {
  struct Handled {
    int signal;
    struct sigaction before;
  };

  std::function<void()> on_ending;
  std::array<int, 2> pipe{-1, -1};
  std::vector<Handled> handled;
  mutable std::mutex mutex;
  EndingCause cause;  // guarded by the mutex
  std::thread thread;

  void end(const EndingCause& why) {
    {
      const std::lock_guard lock(mutex);
      if (cause.text.empty()) cause = why;
    }
    on_ending();
  }

  // Watches until it reads end_of_watch from the pipe. The outputs' requested events are 0: poll() reports errors and
  // hang-ups unasked.
  void watch() {
    const std::vector<Output> outputs = watched_outputs();
    std::vector<pollfd> polled{{pipe[0], POLLIN, 0}};
    for (const Output& output : outputs) polled.push_back({output.descriptor, 0, 0});
    while (true) {
      if (poll(polled.data(), polled.size(), -1) <= 0) continue;  // EINTR
      unsigned char number = end_of_watch;
      while (read(pipe[0], &number, 1) == 1) {
        if (number == end_of_watch) return;
        end({"signal", name_of(number)});
      }
      for (std::size_t i = 0; i < outputs.size(); ++i) {
        if (polled[i + 1].revents == 0) continue;
        polled[i + 1].fd = -1;  // so that each loss is reported once
        end(outputs[i].lost);
      }
    }
  }
};

SignalWatch::SignalWatch(std::function<void()> on_ending) : state_(std::make_unique<State>()) {
  state_->on_ending = std::move(on_ending);
  if (pipe2(state_->pipe.data(), O_CLOEXEC | O_NONBLOCK) != 0) {
    throw description::SetupError(
        {.message = std::string("signals can't be watched: ") + std::strerror(errno), .advice = "see ulimit -n"});
  }
  wake_up.store(state_->pipe[1], std::memory_order_relaxed);
  for (const int signal : ignored_signals) {
    struct sigaction before {};
    handle(signal, SIG_IGN, &before);
    if (signal != SIGPIPE) state_->handled.push_back({signal, before});
  }
  for (const int signal : ending_signals()) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) continue;
    handle(signal, note_signal, &before);
    state_->handled.push_back({signal, before});
  }
  state_->thread = std::thread([this] { state_->watch(); });
}

SignalWatch::~SignalWatch() {
  for (const State::Handled& h : state_->handled) sigaction(h.signal, &h.before, nullptr);
  // The write fails while the pipe is full of signals that the thread has yet to read.
  while (write(state_->pipe[1], &end_of_watch, 1) < 0) {
    if (errno == EAGAIN) std::this_thread::yield();
  }
  state_->thread.join();
  wake_up.store(-1, std::memory_order_relaxed);
  for (const int end : state_->pipe) close(end);
}

EndingCause SignalWatch::cause() const {
  const std::lock_guard lock(state_->mutex);
  return state_->cause;
}

void ignore_ending_signals() noexcept {
  for (const int signal : ending_signals()) std::signal(signal, SIG_IGN);
  for (const int signal : ignored_signals) std::signal(signal, SIG_IGN);
}

}  // namespace proxarm::controller
