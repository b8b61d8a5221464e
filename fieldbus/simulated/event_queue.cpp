#include "fieldbus/simulated/event_queue.hpp"

namespace proxarm::fieldbus {

EventQueue::Slot::Slot(Slot&& other) noexcept
    : operations(other.operations), generation(other.generation), heap_index(other.heap_index) {
  if (operations != nullptr) operations->move_to(other.storage, storage);
  other.operations = nullptr;
}

EventQueue::Slot::~Slot() {
  if (operations != nullptr) operations->destroy(storage);
}

EventQueue::~EventQueue() = default;

void EventQueue::reserve(std::size_t events) {
  heap_.reserve(events);
  slots_.reserve(events);
  free_slots_.reserve(events);
}

std::uint32_t EventQueue::take_slot() {
  if (free_slots_.empty()) {
    // Reserve memory in all three vectors now, so that push() and release_slot() can't fail later.
    slots_.emplace_back();
    heap_.reserve(slots_.capacity());
    free_slots_.reserve(slots_.capacity());
    free_slots_.push_back(static_cast<std::uint32_t>(slots_.size() - 1));
  }
  const std::uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  return slot;
}

EventQueue::EventId EventQueue::push(std::int64_t time_ns, std::uint32_t slot) {
  const Entry entry{time_ns > now_ns_ ? time_ns : now_ns_, next_sequence_++, slot};
  heap_.push_back(entry);
  sift_up(heap_.size() - 1, entry);
  return {slot, slots_[slot].generation};
}

void EventQueue::release_slot(std::uint32_t slot) noexcept {
  slots_[slot].operations = nullptr;
  ++slots_[slot].generation;  // invalidates every EventId that names this slot
  free_slots_.push_back(slot);
}

bool EventQueue::cancel(EventId id) noexcept {
  if (id.slot >= slots_.size()) return false;
  Slot& slot = slots_[id.slot];
  if (slot.generation != id.generation || slot.operations == nullptr) return false;
  remove_at(slot.heap_index);
  slot.operations->destroy(slot.storage);
  release_slot(id.slot);
  return true;
}

bool EventQueue::run_next(std::int64_t limit_ns) {
  if (heap_.empty() || heap_.front().time_ns > limit_ns) return false;
  const Entry entry = heap_.front();
  now_ns_ = entry.time_ns > now_ns_ ? entry.time_ns : now_ns_;
  remove_at(0);
  // Move the callback out of its slot before it runs: the callback may schedule events, and slots move when their
  // vector grows.
  struct Running {
    const Operations* operations;
    alignas(std::max_align_t) std::byte storage[callback_bytes];
    ~Running() { operations->destroy(storage); }
  } running;
  running.operations = slots_[entry.slot].operations;
  running.operations->move_to(slots_[entry.slot].storage, running.storage);
  release_slot(entry.slot);
  running.operations->run(running.storage, entry.time_ns);
  return true;
}

void EventQueue::run_until(std::int64_t time_ns) {
  while (run_next(time_ns)) {
  }
  advance_to(time_ns);
}

void EventQueue::place(std::size_t index, const Entry& entry) noexcept {
  heap_[index] = entry;
  slots_[entry.slot].heap_index = static_cast<std::uint32_t>(index);
}

void EventQueue::sift_up(std::size_t index, const Entry& entry) noexcept {
  while (index > 0) {
    const std::size_t parent = (index - 1) / 2;
    if (!before(entry, heap_[parent])) break;
    place(index, heap_[parent]);
    index = parent;
  }
  place(index, entry);
}

void EventQueue::sift_down(std::size_t index, const Entry& entry) noexcept {
  const std::size_t size = heap_.size();
  for (;;) {
    std::size_t child = 2 * index + 1;
    if (child >= size) break;
    if (child + 1 < size && before(heap_[child + 1], heap_[child])) ++child;
    if (!before(heap_[child], entry)) break;
    place(index, heap_[child]);
    index = child;
  }
  place(index, entry);
}

void EventQueue::remove_at(std::size_t index) noexcept {
  const Entry last = heap_.back();
  heap_.pop_back();
  if (index == heap_.size()) return;
  if (index > 0 && before(last, heap_[(index - 1) / 2])) {
    sift_up(index, last);
  } else {
    sift_down(index, last);
  }
}

}  // namespace proxarm::fieldbus
