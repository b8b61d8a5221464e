// What the cycle sees of the wire: some CAN buses and the one clock that they live by.
//
// Two implementations: SocketCanNetwork (can0, vcan0, the machine's monotonic clock) and SimulatedCanNetwork
// (in-process, virtual time, bit timing and arbitration of every bus). run_cycle() is the same on both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

enum class SendResult : std::uint8_t {
  sent,        // queued at the interface, or on the wire
  queue_full,  // ENOBUFS: nothing was queued
  bus_off,     // the controller is off the bus; its queue was purged
  down,        // interface down or removed
  refused,     // the bus can't carry this frame (CAN FD on a classic bus, a length that isn't one)
};

enum class BusState : std::uint8_t { error_active, error_warning, error_passive, bus_off, down };

// Counters since the bus was opened. None of them wraps in practice (64 bits).
struct BusStatus {
  BusState state = BusState::error_active;
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_received = 0;
  std::uint64_t send_failures = 0;
  std::uint64_t receive_overflows = 0;  // frames the kernel dropped because nobody read them (SO_RXQ_OVFL)
  std::uint64_t error_frames = 0;
};

// One bus as its one user on this side sees it. Neither call blocks, allocates or throws.
class CanBus {
 public:
  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;
  virtual ~CanBus() = default;

  virtual SendResult send(const CanFrame& frame) noexcept = 0;
  // send() for each of these in their order, at the price of one call where the bus can do that; results[i] is that of
  // frames[i], and one that fails doesn't keep the next from being tried. now_ns is the caller's reading of the clock,
  // for who keeps a record.
  virtual void send_all(std::span<const CanFrame> frames, [[maybe_unused]] std::int64_t now_ns,
                        SendResult* results) noexcept {
    for (std::size_t i = 0; i < frames.size(); ++i) results[i] = send(frames[i]);
  }
  // Takes the oldest received frame; false when there is none. Own frames don't come back.
  virtual bool receive(TimedFrame& out) noexcept = 0;
  [[nodiscard]] virtual const BusStatus& status() const noexcept = 0;
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;  // of the interface: "vcan0", or the cell's name
};

// The buses of a cell and their clock, in nanoseconds; its zero means nothing (CLOCK_MONOTONIC, or start of
// simulation).
class CanNetwork {
 public:
  CanNetwork() = default;
  CanNetwork(const CanNetwork&) = delete;
  CanNetwork& operator=(const CanNetwork&) = delete;
  virtual ~CanNetwork() = default;

  [[nodiscard]] virtual std::size_t bus_count() const noexcept = 0;
  [[nodiscard]] virtual CanBus& bus(std::size_t index) noexcept = 0;

  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  // Returns at the deadline or just after it (absolute time).
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
  // Returns true as soon as some bus has a frame to receive, false at the deadline.
  virtual bool wait_for_frame(std::int64_t deadline_ns) noexcept = 0;
  // Time of this machine that went by in wait_for_frame() so far; 0 for who doesn't measure it.
  [[nodiscard]] virtual std::int64_t waited_ns() const noexcept { return 0; }
  // By how much now_ns() is behind the clock that it is to keep pace with: above 0 only where time is simulated and
  // waits for a machine that is late.
  [[nodiscard]] virtual std::int64_t behind_ns() const noexcept { return 0; }
};

}  // namespace proxarm::fieldbus
