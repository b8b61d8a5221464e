// A first-in first-out queue of fixed capacity, for frames. All memory is allocated at construction. Not thread-safe.
#pragma once

#include <cstddef>
#include <vector>

namespace proxarm::fieldbus {

template <class T>
class RingBuffer {
 public:
  explicit RingBuffer(std::size_t capacity) : items_(capacity) {}

  // Appends the item. False if the buffer is full; the item is then not stored.
  bool push(const T& item) noexcept {
    if (size_ == items_.size()) return false;
    std::size_t index = head_ + size_;
    if (index >= items_.size()) index -= items_.size();
    items_[index] = item;
    ++size_;
    return true;
  }
  // Returns the oldest item. Precondition: the buffer isn't empty.
  [[nodiscard]] const T& front() const noexcept { return items_[head_]; }
  void pop() noexcept {
    if (++head_ == items_.size()) head_ = 0;
    --size_;
  }
  void clear() noexcept { head_ = size_ = 0; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return items_.size(); }

 private:
  std::vector<T> items_;
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace proxarm::fieldbus
