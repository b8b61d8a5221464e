// The controller's interface to its CAN buses and to the clock that they share.
//
// There are two implementations. SocketCanNetwork uses the kernel's interfaces (can0, vcan0) and the machine's
// monotonic clock. SimulatedCanNetwork runs in-process in virtual time, with bit timing and arbitration. run_cycle() is
// the same on both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

enum class SendResult : std::uint8_t {
  sent,        // queued at the interface, or on the wire
  queue_full,  // nothing was queued, because the interface's queue is full (ENOBUFS)
  bus_off,     // the CAN controller is off the bus; its queue is purged
  down,        // the interface is down or was removed
  refused,     // the bus can't carry this frame (CAN FD on a classic bus, or an invalid length)
};

enum class BusState : std::uint8_t { error_active, error_warning, error_passive, bus_off, down };

// The state of a bus, and counters since the bus was opened.
struct BusStatus {
  BusState state = BusState::error_active;
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_received = 0;
  std::uint64_t send_failures = 0;
  // Frames that the kernel dropped because its buffer was full (SO_RXQ_OVFL), and overflows that the CAN controller
  // reported.
  std::uint64_t receive_overflows = 0;
  std::uint64_t error_frames = 0;
};

// One CAN bus as its only user in this process sees it. No function blocks, allocates or throws.
class CanBus {
 public:
  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;
  virtual ~CanBus() = default;

  virtual SendResult send(const CanFrame& frame) noexcept = 0;
  // Sends the frames in order, in one system call if possible. results[i] belongs to frames[i]. A frame that can't be
  // sent doesn't stop the frames after it. now_ns is the time that the caller has just read from the clock;
  // implementations that record frames use it.
  virtual void send_all(std::span<const CanFrame> frames, [[maybe_unused]] std::int64_t now_ns,
                        SendResult* results) noexcept {
    for (std::size_t i = 0; i < frames.size(); ++i) results[i] = send(frames[i]);
  }
  // Takes the oldest received frame out of the queue; false if the queue is empty. The frames that this side sent
  // aren't received.
  virtual bool receive(TimedFrame& out) noexcept = 0;
  [[nodiscard]] virtual const BusStatus& status() const noexcept = 0;
  // Returns the name of the interface ("vcan0"), or the bus's name in the cell.
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
};

// The buses of a cell and their clock. The clock counts nanoseconds from an arbitrary zero (that of CLOCK_MONOTONIC, or
// the start of the simulation).
class CanNetwork {
 public:
  CanNetwork() = default;
  CanNetwork(const CanNetwork&) = delete;
  CanNetwork& operator=(const CanNetwork&) = delete;
  virtual ~CanNetwork() = default;

  [[nodiscard]] virtual std::size_t bus_count() const noexcept = 0;
  [[nodiscard]] virtual CanBus& bus(std::size_t index) noexcept = 0;

  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  // Returns at the deadline or just after it. The deadline is an absolute time of this clock.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
  // Returns true as soon as any bus has a frame to receive, and false at the deadline.
  virtual bool wait_for_frame(std::int64_t deadline_ns) noexcept = 0;
  // Returns the real time spent in wait_for_frame() so far; 0 if the implementation doesn't measure it.
  [[nodiscard]] virtual std::int64_t waited_ns() const noexcept { return 0; }
  // Returns how far now_ns() lags behind the clock that it follows. The lag is above 0 only in simulation, where
  // virtual time waits for a slow machine.
  [[nodiscard]] virtual std::int64_t behind_ns() const noexcept { return 0; }
};

}  // namespace proxarm::fieldbus
