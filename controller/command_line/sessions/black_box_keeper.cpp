#include "controller/command_line/sessions/black_box_keeper.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "controller/library/black_box_files.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/report/session_record.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

namespace {

namespace fs = std::filesystem;

fs::path folder_for(const controller::RunOptions& options) {
  const fs::path folder = controller::black_box_folder(options);
  return folder.empty() ? "proxarm-black-box" : folder;
}

// The size of the session's box.
controller::BoxSize size_for(const controller::PreparedSession& session, const controller::RunOptions& options) {
  return controller::box_size(session, !options.control.empty() || !options.changes.empty());
}

}  // namespace

struct BlackBoxKeeper::Shared {
  controller::ReplayHead head;
  std::array<char, 2048> reason{};
  std::atomic<bool> written{false};  // set by the keeper when everything is on the disk
};

namespace {
[[noreturn]] void refuse_start(const char* what) {
  throw description::SetupError({.message = std::string(what) + " of the black box: " + std::strerror(errno),
                                 .advice = "see ulimit -a: open files, processes, memory"});
}
}  // namespace

BlackBoxKeeper::BlackBoxKeeper(const controller::PreparedSession& session, const controller::RunOptions& options)
    : session_(session),
      folder_(fs::absolute(folder_for(options))),
      box_(size_for(session, options).period_s, size_for(session, options).frames_per_cycle,
           options.view ? controller::BlackBox::Memory::by_descriptor : controller::BlackBox::Memory::forked) {
  if (!options.black_box_dir.empty()) controller::SessionWriter(folder_, {}, false);
  void* const memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) refuse_start("the memory");
  shared_ = new (memory) Shared;
  start();
}

void BlackBoxKeeper::start() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) refuse_start("the pipe to the keeper");
  std::fflush(nullptr);
  child_ = fork();
  if (child_ == 0) {
    close(ends[1]);
    keep(ends[0]);
  }
  close(ends[0]);
  say_ = ends[1];
  if (child_ < 0) std::fprintf(stderr, "proxarm: no black box: %s\n", std::strerror(errno));
}

BlackBoxKeeper::~BlackBoxKeeper() {
  close(say_);
  if (child_ > 0) waitpid(child_, nullptr, 0);
  munmap(shared_, sizeof(Shared));
}

void BlackBoxKeeper::set_head(const controller::ReplayHead& head) noexcept { shared_->head = head; }
const controller::ReplayHead& BlackBoxKeeper::head() const noexcept { return shared_->head; }

bool BlackBoxKeeper::finish(const std::string& reason) {
  reason.copy(shared_->reason.data(), shared_->reason.size() - 1);
  const char word = reason.empty() ? 'f' : 'w';
  while (::write(say_, &word, 1) < 0 && errno == EINTR) {
  }
  if (child_ > 0) waitpid(child_, nullptr, 0);
  child_ = -1;
  return shared_->written.load();
}

// Waits for the session's end, and writes the box if necessary. Runs in the keeper's process.
void BlackBoxKeeper::keep(int said) {
  prctl(PR_SET_NAME, "proxarm-box");
  controller::ignore_ending_signals();
  char word = 0;
  ssize_t got = 0;
  do {
    got = read(said, &word, 1);
  } while (got < 0 && errno == EINTR);
  const bool died = got <= 0;
  if (!died && word == 'f') _exit(0);
  try {
    // If the session ended before its first cycle, there is nothing to write, and the session has reported the reason
    // itself.
    if (box_.cycles() > 0) {
      write(died ? "The session ended without a word: the program crashed or was killed." : shared_->reason.data());
      if (died) std::fprintf(stderr, "proxarm: the session died; its black box is in %s\n", folder_.c_str());
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "proxarm: no black box could be written: %s\n", error.what());
  }
  _exit(0);
}

void BlackBoxKeeper::write(const std::string& reason) const {
  controller::write_black_box(folder_, box_, shared_->head, session_, reason);
  shared_->written.store(true);
}

}  // namespace proxarm::command_line
