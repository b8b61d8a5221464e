// Passes the latest value from one thread to another thread, without waiting. The reader may miss values, but never
// gets a half-written value. Only one thread may write, and only one thread may read.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace proxarm::fieldbus {

template <class T>
class TripleBuffer {
 public:
  void write(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | fresh), std::memory_order_acq_rel) & place;
  }
  // Returns false and leaves `out` unchanged if nothing was written since the last read.
  bool read(T& out) noexcept {
    if ((middle_.load(std::memory_order_relaxed) & fresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & place;
    out = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t fresh = 4, place = 3;
  std::array<T, 3> slots_{};
  std::atomic<std::uint8_t> middle_{1};
  std::uint8_t back_ = 0;   // the writer's slot
  std::uint8_t front_ = 2;  // the reader's slot
};

}  // namespace proxarm::fieldbus
