// A queue of events at absolute times, which runs the simulated devices and buses.
//
// The queue serves virtual time and real time. In virtual time, SimulatedCanNetwork runs events until the controller's
// deadline. In real time, a loop sleeps until next_time() and then calls run_until(). Times are int64 nanoseconds of
// the owner's clock.
//
// Events run in the order of their times. Events of equal time run in the order in which they were scheduled, so a run
// depends on its input alone. An event that is scheduled for a time in the past gets the time now_ns(): time never
// steps back.
//
// A callback is any movable callable of at most `callback_bytes` bytes. It is called as f() or f(time_ns) with the
// event's time. It may schedule and cancel events. Storage of callbacks is reused: the queue allocates only if more
// events are pending than ever before and more than were given to reserve(). Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace proxarm::fieldbus {

class EventQueue {
 public:
  static constexpr std::size_t callback_bytes = 48;
  static constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

  // Names a scheduled event; a default EventId names no event. cancel() may be called even after the event has run.
  struct EventId {
    std::uint32_t slot = 0;
    std::uint32_t generation = 0;
  };

  EventQueue() = default;
  explicit EventQueue(std::int64_t start_ns) : now_ns_(start_ns) {}
  EventQueue(const EventQueue&) = delete;
  EventQueue& operator=(const EventQueue&) = delete;
  ~EventQueue();

  void reserve(std::size_t events);

  template <class F>
  EventId schedule(std::int64_t time_ns, F&& callback) {
    using Callable = std::decay_t<F>;
    static_assert(sizeof(Callable) <= callback_bytes, "capture less: a pointer to the state, not the state");
    static_assert(alignof(Callable) <= alignof(std::max_align_t));
    static_assert(std::is_nothrow_move_constructible_v<Callable>);
    const std::uint32_t slot = take_slot();
    ::new (static_cast<void*>(slots_[slot].storage)) Callable(std::forward<F>(callback));
    slots_[slot].operations = &operations_of<Callable>;
    return push(time_ns, slot);
  }
  template <class F>
  EventId schedule_after(std::int64_t delay_ns, F&& callback) {
    return schedule(now_ns_ + delay_ns, std::forward<F>(callback));
  }
  // Cancels an event. True if the event was still pending. Its callback is then destroyed at once and never runs.
  bool cancel(EventId id) noexcept;

  // Runs all events up to and including time_ns in order, also events that are scheduled while it runs. Then now_ns()
  // is time_ns.
  void run_until(std::int64_t time_ns);
  // Runs the next event if its time is at most limit_ns; then now_ns() is the event's time. False if there is no such
  // event.
  bool run_next(std::int64_t limit_ns = never);
  // Advances time without running events, for a real-time loop that is going to handle input. Time never steps back.
  // Precondition: next_time() > time_ns.
  void advance_to(std::int64_t time_ns) noexcept { now_ns_ = time_ns > now_ns_ ? time_ns : now_ns_; }

  [[nodiscard]] std::int64_t now_ns() const noexcept { return now_ns_; }
  [[nodiscard]] std::int64_t next_time() const noexcept { return heap_.empty() ? never : heap_.front().time_ns; }
  [[nodiscard]] std::size_t pending() const noexcept { return heap_.size(); }

 private:
  struct Operations {
    void (*run)(void* callable, std::int64_t time_ns);
    void (*move_to)(void* from, void* to) noexcept;  // moves the callable and destroys it at `from`
    void (*destroy)(void* callable) noexcept;
  };
  struct Slot {
    alignas(std::max_align_t) std::byte storage[callback_bytes];
    const Operations* operations = nullptr;
    std::uint32_t generation = 1;
    std::uint32_t heap_index = 0;

    Slot() = default;
    Slot(Slot&& other) noexcept;
    Slot& operator=(Slot&&) = delete;
    ~Slot();
  };
  struct Entry {
    std::int64_t time_ns;
    std::uint64_t sequence;
    std::uint32_t slot;
  };

  template <class Callable>
  static void run_callable(void* callable, std::int64_t time_ns) {
    auto& f = *static_cast<Callable*>(callable);
    if constexpr (std::is_invocable_v<Callable&, std::int64_t>) {
      f(time_ns);
    } else {
      f();
    }
  }
  template <class Callable>
  static void move_callable(void* from, void* to) noexcept {
    if constexpr (std::is_trivially_copyable_v<Callable>) {
      std::memcpy(to, from, sizeof(Callable));
    } else {
      auto* source = static_cast<Callable*>(from);
      ::new (to) Callable(std::move(*source));
      source->~Callable();
    }
  }
  template <class Callable>
  static void destroy_callable(void* callable) noexcept {
    std::destroy_at(static_cast<Callable*>(callable));
  }
  template <class Callable>
  static constexpr Operations operations_of{&run_callable<Callable>, &move_callable<Callable>,
                                            &destroy_callable<Callable>};

  static bool before(const Entry& a, const Entry& b) noexcept {
    return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : a.sequence < b.sequence;
  }
  std::uint32_t take_slot();
  EventId push(std::int64_t time_ns, std::uint32_t slot);
  void release_slot(std::uint32_t slot) noexcept;
  void place(std::size_t index, const Entry& entry) noexcept;
  void sift_up(std::size_t index, const Entry& entry) noexcept;
  void sift_down(std::size_t index, const Entry& entry) noexcept;
  void remove_at(std::size_t index) noexcept;

  std::int64_t now_ns_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::vector<Entry> heap_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_slots_;
};

}  // namespace proxarm::fieldbus
