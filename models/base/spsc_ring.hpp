// A queue between two threads that neither ever waits: one pushes (the cycle), one pops (whoever writes files).
//
// Capacity is fixed at construction, which is the only allocation. push() of a full ring refuses and counts, so the
// cycle never waits for a disk. The two indices live on cache lines of their own, and each side keeps a copy of the
// other's index, so a push or a pop touches shared memory only when the copy says full or empty.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace proxarm::controller {

template <typename T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "what crosses threads is plain data");

 public:
  // Room for at least `capacity` items: the next power of two, at least 2.
  explicit SpscRing(std::size_t capacity)
      : items_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity)), mask_(items_.size() - 1) {}

  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  // Producer only. False when full: the item is dropped and counted.
  bool push(const T& item) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == items_.size()) {
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ == items_.size()) {
        dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return false;
      }
    }
    items_[tail & mask_] = item;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // Producer only: that many pushes succeed.
  [[nodiscard]] std::size_t room() noexcept {
    head_seen_ = head_.load(std::memory_order_acquire);
    return items_.size() - (tail_.load(std::memory_order_relaxed) - head_seen_);
  }

  // Consumer only. False when empty.
  bool pop(T& item) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return false;
    }
    item = items_[head & mask_];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  [[nodiscard]] std::size_t capacity() const noexcept { return items_.size(); }
  // Any thread: how many items a full ring has refused.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  // 64 bytes on every CPU that this runs on; std::hardware_destructive_interference_size isn't in clang 14.
  static constexpr std::size_t cache_line = 64;

  std::vector<T> items_;
  std::size_t mask_;
  alignas(cache_line) std::atomic<std::size_t> tail_{0};  // producer's line
  std::size_t head_seen_ = 0;
  std::atomic<std::uint64_t> dropped_{0};
  alignas(cache_line) std::atomic<std::size_t> head_{0};  // consumer's line
  std::size_t tail_seen_ = 0;
  [[maybe_unused]] alignas(cache_line) char end_of_line_ = 0;
};

}  // namespace proxarm::controller
