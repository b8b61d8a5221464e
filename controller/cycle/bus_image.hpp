// Connects the cycle to the buses: sends SYNC and poll, receives answers, sends setpoints.
//
//   begin()            sends SYNC on every drive bus, then the sensor's poll
//   receive_until()    passes frames to sensor, drives and other listeners until all devices have answered, or until
//                      the deadline
//   send_setpoints()   queues the drives' setpoints, and the controller's heartbeat if it is due
//   hand_over()        passes the queued frames to the interfaces, one call per bus
//
// Two kinds of frames raise a fault: a frame that can't be sent, and a received frame that only a master may send.
// Every frame is recorded. Nothing allocates, locks or throws after construction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/cycle/cycle_recorder.hpp"
#include "controller/cycle/frame_listener.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/setpoints.hpp"
#include "controller/supervision/alarm.hpp"
#include "fieldbus/cia402/cia402_goodbye.hpp"

namespace proxarm::controller {

class BusImage {
 public:
  // Precondition: `parts`, `recorder` and `alarm` outlive this object.
  BusImage(CycleParts& parts, CycleRecorder& recorder, Alarm& alarm);

  void begin(std::int64_t t_k_ns) noexcept;
  void receive_until(std::int64_t deadline_ns, FrameListener& listener) noexcept;
  // Reads and records the present status of each bus. Call once per cycle.
  std::span<const fieldbus::BusStatus> read_status() noexcept;
  // The last result of read_status().
  [[nodiscard]] std::span<const fieldbus::BusStatus> status() const noexcept { return status_; }
  void send_setpoints(const Setpoints& setpoints, std::int64_t t_k_ns, std::uint64_t cycle) noexcept;
  // Queues a frame behind the earlier frames for this bus. The next hand_over() sends it.
  void send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept;
  void hand_over() noexcept;

  void request(fieldbus::DriveGoal goal) noexcept;
  // Whether all drives have reported that they no longer hold their joints. The last report of each drive counts, even
  // if the drive has become silent.
  [[nodiscard]] bool drives_off() const noexcept;
  // The first drive that hasn't reported that it no longer holds its joint; −1: there is none.
  [[nodiscard]] std::int32_t first_drive_on() const noexcept;
  void forget_faults() noexcept;
  // Sends SYNC, controlwords and heartbeats in each period until all drives that are off no longer wait for these
  // messages (cia402_goodbye.hpp), for at most 0.3 s. Then sends the drives to NMT pre-operational. Precondition: the
  // last cycle has run.
  void shut_down(std::int64_t period_ns) noexcept;

  // Writes the sent and received values of this cycle.
  void write_record(CycleRecord& record) const noexcept;
  // Writes the inputs of this cycle for the black box.
  void write_inputs(BoxCycle& entry) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  // Frames for one bus, which are passed to the bus's interface together.
  struct Outbox {
    std::array<fieldbus::CanFrame, 16> frames{};
    std::array<fieldbus::SendResult, 16> results{};
    std::size_t count = 0;
  };

  void receive_all(FrameListener& listener) noexcept;
  void deliver(std::size_t bus, const fieldbus::TimedFrame& received, FrameListener& listener) noexcept;
  [[nodiscard]] bool is_masters_own(std::size_t bus, const fieldbus::CanFrame& frame) const noexcept;
  [[nodiscard]] bool everything_received() const noexcept;
  void hand_over(std::size_t first_bus, std::size_t end_bus) noexcept;
  void note_sent(std::size_t bus, std::int64_t handed_over_ns) noexcept;
  // The three functions below run after the last cycle. They raise no faults and don't write to the record.
  void say_goodbye(std::int64_t period_ns) noexcept;
  void send_last_words(std::int64_t t_ns) noexcept;
  void listen_until(std::int64_t deadline_ns) noexcept;

  CycleParts& parts_;
  CycleRecorder& recorder_;
  Alarm& alarm_;
  std::vector<Outbox> outboxes_;             // one for each bus; empty between cycles
  std::vector<fieldbus::BusStatus> status_;  // one for each bus
  fieldbus::Goodbye goodbye_;
  std::int64_t begun_ns_ = -1;  // t_k of the last cycle; below zero: no cycle has run
  std::uint64_t cycle_ = 0;     // number of the cycle, which times the heartbeat; continues during the goodbye
  bool sends_torques_ = false;
};

}  // namespace proxarm::controller
