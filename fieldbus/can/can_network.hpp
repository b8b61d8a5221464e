// The controller's interface to its CAN buses and to their common clock.
//
// Two implementations: SocketCanNetwork (can0, vcan0, the machine's monotonic clock) and SimulatedCanNetwork
// (in-process, virtual time, with bit timing and arbitration). run_cycle() is the same on both.
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
  bus_off,     // the controller is off the bus; its queue is purged
  down,        // interface down or removed
  refused,     // the bus can't carry this frame (CAN FD on a classic bus, invalid length)
};

enum class BusState : std::uint8_t { error_active, error_warning, error_passive, bus_off, down };

// Counters since the bus was opened.
struct BusStatus {
  BusState state = BusState::error_active;
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_received = 0;
  std::uint64_t send_failures = 0;
  std::uint64_t receive_overflows = 0;  // frames dropped by the kernel, its buffer being full (SO_RXQ_OVFL)
  std::uint64_t error_frames = 0;
};

// One bus, for a single user on this side. No function blocks, allocates or throws.
class CanBus {
 public:
  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;
  virtual ~CanBus() = default;

  virtual SendResult send(const CanFrame& frame) noexcept = 0;
  // Sends these frames in order, in one system call if possible; results[i] belongs to frames[i]. A failed frame
  // doesn't stop the following ones. now_ns is the caller's reading of the clock, for implementations that record
  // frames.
  virtual void send_all(std::span<const CanFrame> frames, [[maybe_unused]] std::int64_t now_ns,
                        SendResult* results) noexcept {
    for (std::size_t i = 0; i < frames.size(); ++i) results[i] = send(frames[i]);
  }
  // Takes the oldest received frame; false if there is none. Own frames aren't received.
  virtual bool receive(TimedFrame& out) noexcept = 0;
  [[nodiscard]] virtual const BusStatus& status() const noexcept = 0;
  // The interface ("vcan0"), or the bus's name in the cell.
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
};

// The buses of a cell and their clock in nanoseconds, with an arbitrary zero (CLOCK_MONOTONIC, or start of simulation).
class CanNetwork {
 public:
  CanNetwork() = default;
  CanNetwork(const CanNetwork&) = delete;
  CanNetwork& operator=(const CanNetwork&) = delete;
  virtual ~CanNetwork() = default;

  [[nodiscard]] virtual std::size_t bus_count() const noexcept = 0;
  [[nodiscard]] virtual CanBus& bus(std::size_t index) noexcept = 0;

  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  // Returns at the deadline (absolute time) or just after it.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
  // True as soon as any bus has a frame to receive, false at the deadline.
  virtual bool wait_for_frame(std::int64_t deadline_ns) noexcept = 0;
  // Real time spent in wait_for_frame() so far; 0 if not measured.
  [[nodiscard]] virtual std::int64_t waited_ns() const noexcept { return 0; }
  // How far now_ns() lags behind the clock it follows. Above 0 only in simulation, where time waits for a slow machine.
  [[nodiscard]] virtual std::int64_t behind_ns() const noexcept { return 0; }
};

}  // namespace proxarm::fieldbus
