// What a running cycle is asked for, of one kind: by a script, each at its time, and by another thread through a ring.
//
// The script goes first. At most one request is taken per call of take(), so that each has a cycle of its own.
// schedule() is called before the first cycle, push() by one thread at any time, the rest by the cycle alone, which
// neither allocates, locks nor waits here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "models/base/scheduled.hpp"
#include "models/base/spsc_ring.hpp"

namespace proxarm::controller {

template <typename T>
class Requests {
 public:
  explicit Requests(std::size_t capacity) : ring_(capacity) {}

  // In the order of their times.
  void schedule(std::vector<Scheduled<T>> script) { script_ = std::move(script); }
  // False: too many wait already, and this one is dropped.
  bool push(const T& request) noexcept { return ring_.push(request); }
  // By whoever pushes: that many pushes succeed.
  [[nodiscard]] std::size_t room() noexcept { return ring_.room(); }

  // The request of the script whose time has come; nullptr: none has. It stays until take() takes it.
  [[nodiscard]] const T* due(std::int64_t now_ns) const noexcept {
    return next_ < script_.size() && script_[next_].at_ns <= now_ns ? &script_[next_].request : nullptr;
  }
  // The script's request that is due, or else the oldest of the other thread. False: there is none.
  bool take(std::int64_t now_ns, T& out) noexcept {
    scripted_ = nullptr;
    if (due(now_ns) != nullptr) {
      scripted_ = &script_[next_++];
      scripted_->taken = true;
      out = scripted_->request;
      return true;
    }
    if (!ring_.pop(out)) return false;
    ++taken_from_thread_;
    return true;
  }
  // Why the request that was taken last did nothing, or nullptr; kept for those of the script.
  void note_refusal(const char* refusal) noexcept {
    if (scripted_ != nullptr) scripted_->refusal = refusal;
  }
  [[nodiscard]] std::span<const Scheduled<T>> script() const noexcept { return script_; }
  // How many of the other thread's requests have been taken.
  [[nodiscard]] std::uint32_t taken_from_thread() const noexcept { return taken_from_thread_; }

 private:
  SpscRing<T> ring_;
  std::vector<Scheduled<T>> script_;
  std::size_t next_ = 0;              // of the script
  Scheduled<T>* scripted_ = nullptr;  // the one that was taken last, if it is of the script
  std::uint32_t taken_from_thread_ = 0;
};

}  // namespace proxarm::controller
