// The cycle's side of the wire: SYNC and poll out, answers in, setpoints out.
//
//   begin()           sends SYNC on every drive bus, then the sensor's poll
//   receive_until()   gives frames to sensor, drives and other listeners, until every device has answered or time is up
//   send_setpoints()  queues the drives' setpoints, and the controller's heartbeat if one is due
//   hand_over()       gives the queued frames to the interfaces: those of a bus in one call
//
// Two kinds of frames raise a fault: one that can't be sent, and one that is received but only a master may send. The
// recorder gets every frame, too. Nothing allocates, locks or throws after construction.
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
  // Precondition: all three outlive this object.
  BusImage(CycleParts& parts, CycleRecorder& recorder, Alarm& alarm);

  void begin(std::int64_t t_k_ns) noexcept;
  void receive_until(std::int64_t deadline_ns, FrameListener& listener) noexcept;
  // The present status of each bus. To be called once per cycle, since the recorder keeps it.
  std::span<const fieldbus::BusStatus> read_status() noexcept;
  // The status that read_status() returned last.
  [[nodiscard]] std::span<const fieldbus::BusStatus> status() const noexcept { return status_; }
  void send_setpoints(const Setpoints& setpoints, std::int64_t t_k_ns, std::uint64_t cycle) noexcept;
  // Queues a frame, which leaves with the next hand_over(), behind those queued before on this bus.
  void send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept;
  void hand_over() noexcept;

  void request(fieldbus::DriveGoal goal) noexcept;
  // Whether each drive has reported that it no longer holds its axis. The last report counts; a drive that has gone
  // silent since can't withdraw it.
  [[nodiscard]] bool drives_off() const noexcept;
  // The first drive that hasn't reported so, or −1.
  [[nodiscard]] std::int32_t first_drive_on() const noexcept;
  void forget_faults() noexcept;
  // Precondition: the last cycle has run. Goes on sending SYNC, controlwords and heartbeats, a period at a time, until
  // each drive that is off no longer waits for them (cia402_goodbye.hpp), for 0.3 s at most. Then the drives go back to
  // NMT pre-operational.
  void shut_down(std::int64_t period_ns) noexcept;

  // What was sent and what came in, for the record and for the black box.
  void write_record(CycleRecord& record) const noexcept;
  void write_inputs(BoxCycle& entry) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  // Frames for one bus, which go to its interface together.
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
  // After the last cycle, nothing raises a fault or goes into the record.
  void say_goodbye(std::int64_t period_ns) noexcept;
  void send_last_words(std::int64_t t_ns) noexcept;
  void listen_until(std::int64_t deadline_ns) noexcept;

  CycleParts& parts_;
  CycleRecorder& recorder_;
  Alarm& alarm_;
  std::vector<Outbox> outboxes_;             // by bus; empty between cycles
  std::vector<fieldbus::BusStatus> status_;  // by bus
  fieldbus::Goodbye goodbye_;
  std::int64_t begun_ns_ = -1;  // the last cycle's t_k; below zero: there was none
  std::uint64_t cycle_ = 0;     // goes on while saying goodbye, since the heartbeat is timed by it
  bool sends_torques_ = false;
};

}  // namespace proxarm::controller
