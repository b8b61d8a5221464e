// A lock-free queue between two threads: one thread pushes (the cycle), the other thread pops (a writer of files).
//
// Only the constructor allocates. push() to a full ring drops the item and counts it, so the cycle never waits for a
// disk. The two indices are on separate cache lines, and each thread keeps a copy of the other thread's index. push()
// and pop() read the other thread's cache line only if the copy says that the ring is full or empty.
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
  // Makes room for at least `capacity` items. The number of items is the next power of two, at least 2.
  explicit SpscRing(std::size_t capacity)
      : items_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity)), mask_(items_.size() - 1) {}

  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  // Only for the thread that pushes. Returns false if the ring is full; the item is then dropped and counted.
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

  // Only for the thread that pushes. Returns the number of pushes that will succeed.
  [[nodiscard]] std::size_t room() noexcept {
    head_seen_ = head_.load(std::memory_order_acquire);
    return items_.size() - (tail_.load(std::memory_order_relaxed) - head_seen_);
  }

  // Only for the thread that pops. Returns false if the ring is empty.
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
  // For any thread. Returns the number of dropped items.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  // A cache line has 64 bytes on all supported CPUs. (clang 14 doesn't have
  // std::hardware_destructive_interference_size.)
  static constexpr std::size_t cache_line = 64;

  std::vector<T> items_;
  std::size_t mask_;
  // The cache line of the thread that pushes begins here.
  alignas(cache_line) std::atomic<std::size_t> tail_{0};
  std::size_t head_seen_ = 0;
  std::atomic<std::uint64_t> dropped_{0};
  // The cache line of the thread that pops begins here.
  alignas(cache_line) std::atomic<std::size_t> head_{0};
  std::size_t tail_seen_ = 0;
  [[maybe_unused]] alignas(cache_line) char end_of_line_ = 0;
};

}  // namespace proxarm::controller
