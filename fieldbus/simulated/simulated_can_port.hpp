// The ports of a simulated bus. Only for the source files of SimulatedCanBus.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "fieldbus/simulated/simulated_can_bus.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint64_t no_frame = std::numeric_limits<std::uint64_t>::max();

// Returns the bits of arbitration up to the BRS bit as a number. The first bit on the wire is the most significant bit,
// so the lowest number wins:
//   11-bit: id 11, RTR, IDE 0, FDF
//   29-bit: id 11, SRR 1, IDE 1, id 18, RTR, FDF
inline std::uint64_t arbitration_key(const CanFrame& frame) noexcept {
  const std::uint64_t remote = frame.remote ? 1 : 0, fd = frame.fd ? 1 : 0;
  if (!frame.extended) return (std::uint64_t{frame.id} << 22) | (remote << 21) | (fd << 19);
  const std::uint64_t base = frame.id >> 18, extension = frame.id & 0x3ffff;
  return (base << 22) | (3ull << 20) | (extension << 2) | (remote << 1) | fd;
}

inline bool is_off(BusState state) noexcept { return state == BusState::bus_off || state == BusState::down; }

class SimulatedCanBus::Port final : public CanPort {
 public:
  struct Queued {
    CanFrame frame;
    std::int64_t time_ns = 0;
  };

  Port(SimulatedCanBus& bus, std::string name, CanListener* listener, std::size_t queue_length)
      : name_(std::move(name)), listener_(listener), queue_(queue_length + 1), bus_(bus) {}

  SendResult send(const CanFrame& frame) noexcept override { return bus_.queue_frame(*this, frame); }

  bool push(const CanFrame& frame, std::int64_t time_ns) noexcept {
    if (!queue_.push({frame, time_ns})) return false;
    if (queue_.size() == 1) key_ = arbitration_key(frame);
    return true;
  }
  void pop() noexcept {
    queue_.pop();
    key_ = queue_.empty() ? no_frame : arbitration_key(queue_.front().frame);
  }
  void purge() noexcept {
    queue_.clear();
    key_ = no_frame;
  }
  [[nodiscard]] const Queued& head() const noexcept { return queue_.front(); }
  [[nodiscard]] std::size_t queue_size() const noexcept { return queue_.size(); }
  // Key of the head frame; no_frame: the queue is empty.
  [[nodiscard]] std::uint64_t key() const noexcept { return key_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] CanListener* listener() const noexcept { return listener_; }
  [[nodiscard]] bool receives() const noexcept { return listener_ != nullptr || this == bus_.ports_.front().get(); }
  [[nodiscard]] BusState state() const noexcept { return state_; }
  void set_state(BusState state) noexcept { state_ = state; }

  ErrorCounters errors;
  bool follows_errors = true;  // false: a fault rule sets the port's state

 private:
  std::uint64_t key_ = no_frame;
  BusState state_ = BusState::error_active;
  std::string name_;
  CanListener* listener_;  // nullptr: the controller, or a babbling node
  RingBuffer<Queued> queue_;
  SimulatedCanBus& bus_;
};

}  // namespace proxarm::fieldbus
