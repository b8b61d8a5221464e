// Requests of one kind to a running cycle: by a script, each at its time, and by another thread through a ring.
//
// The script goes first. Each call of take() takes at most one request, so that each has a cycle of its own.
// Precondition: schedule() is called before the first cycle, push() and room() by one thread, and the rest by the cycle
// alone. The cycle neither allocates, locks nor waits here.
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

  // Precondition: `script` is sorted by time.
  void schedule(std::vector<Scheduled<T>> script) { script_ = std::move(script); }
  // Returns false if too many requests are waiting, and drops this one.
  bool push(const T& request) noexcept { return ring_.push(request); }
  // How many pushes are certain to succeed. To be called by the thread that pushes.
  [[nodiscard]] std::size_t room() noexcept { return ring_.room(); }

  // The script's next request if its time has come, else nullptr. It stays until take() takes it.
  [[nodiscard]] const T* due(std::int64_t now_ns) const noexcept {
    return next_ < script_.size() && script_[next_].at_ns <= now_ns ? &script_[next_].request : nullptr;
  }
  // Takes the script's request that is due, or else the oldest one of the other thread. Returns false if there is none.
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
  // Notes why the request that was taken last did nothing (nullptr: it did). Only the script's refusals are kept.
  void note_refusal(const char* refusal) noexcept {
    if (scripted_ != nullptr) scripted_->refusal = refusal;
  }
  [[nodiscard]] std::span<const Scheduled<T>> script() const noexcept { return script_; }
  // How many of the other thread's requests have been taken.
  [[nodiscard]] std::uint32_t taken_from_thread() const noexcept { return taken_from_thread_; }

 private:
  SpscRing<T> ring_;
  std::vector<Scheduled<T>> script_;
  std::size_t next_ = 0;              // index of the script's next request
  Scheduled<T>* scripted_ = nullptr;  // the request taken last, if it is of the script
  std::uint32_t taken_from_thread_ = 0;
};

}  // namespace proxarm::controller
