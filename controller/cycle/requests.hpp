// Passes requests of one kind to a running cycle: requests of a script, each at its time, and requests of another
// thread, through a ring.
//
// The script has priority. take() takes at most one request, so each cycle gets at most one. Preconditions: schedule()
// is called before the first cycle; one thread calls push() and room(); only the cycle calls the other functions. The
// cycle's functions don't allocate, lock or wait.
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
  // Returns false and drops the request if too many are waiting.
  bool push(const T& request) noexcept { return ring_.push(request); }
  // Number of pushes that are certain to succeed. Precondition: the thread that pushes calls this function.
  [[nodiscard]] std::size_t room() noexcept { return ring_.room(); }

  // Returns the script's next request if its time has come, else nullptr. The request stays until take() takes it.
  [[nodiscard]] const T* due(std::int64_t now_ns) const noexcept {
    return next_ < script_.size() && script_[next_].at_ns <= now_ns ? &script_[next_].request : nullptr;
  }
  // Takes the script's due request; if no request of the script is due, the other thread's oldest request. Returns
  // false if there is no request.
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
  // Notes the reason why the request that was taken last had no effect; nullptr: it had an effect. Keeps only refusals
  // of the script's requests.
  void note_refusal(const char* refusal) noexcept {
    if (scripted_ != nullptr) scripted_->refusal = refusal;
  }
  [[nodiscard]] std::span<const Scheduled<T>> script() const noexcept { return script_; }
  // Number of the other thread's requests that were taken.
  [[nodiscard]] std::uint32_t taken_from_thread() const noexcept { return taken_from_thread_; }

 private:
  SpscRing<T> ring_;
  std::vector<Scheduled<T>> script_;
  std::size_t next_ = 0;              // index of the script's next request
  Scheduled<T>* scripted_ = nullptr;  // the request that was taken last, if it was from the script; else null
  std::uint32_t taken_from_thread_ = 0;
};

}  // namespace proxarm::controller
