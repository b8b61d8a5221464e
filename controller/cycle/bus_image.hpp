// The cycle's side of the wire: SYNC and poll out, answers in, setpoints out.
//
//   begin()           SYNC on every drive bus, then the sensor's poll
//   receive_until()   frames to sensor, drives, whoever else listens, until every device has answered or time is up
//   send_setpoints()  to the drives, and the controller's heartbeat where one is due
//   hand_over()       what was sent since, to the interfaces: the frames of a bus in one call
//
// What goes wrong on the way is a fault: a frame that can't be sent, and one that only a master sends. Every frame goes
// to the recorder, too. Nothing allocates, locks or throws after construction.
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
  // All must outlive this.
  BusImage(CycleParts& parts, CycleRecorder& recorder, Alarm& alarm);

  void begin(std::int64_t t_k_ns) noexcept;
  void receive_until(std::int64_t deadline_ns, FrameListener& listener) noexcept;
  // Of each bus, as of now; once per cycle, since the recorder keeps it.
  std::span<const fieldbus::BusStatus> read_status() noexcept;
  // As it was read last.
  [[nodiscard]] std::span<const fieldbus::BusStatus> status() const noexcept { return status_; }
  void send_setpoints(const Setpoints& setpoints, std::int64_t t_k_ns, std::uint64_t cycle) noexcept;
  // Leaves with the next hand_over(), behind what was sent before on this bus.
  void send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept;
  void hand_over() noexcept;

  void request(fieldbus::DriveGoal goal) noexcept;
  // Whether each drive has said that it doesn't hold its axis any more; its last word counts, which a drive that has
  // gone silent can't take back.
  [[nodiscard]] bool drives_off() const noexcept;
  // The first drive that hasn't, or −1.
  [[nodiscard]] std::int32_t first_drive_on() const noexcept;
  void forget_faults() noexcept;
  // After the last cycle: goes on with SYNC, controlwords and heartbeat, a period at a time, until each drive that is
  // off no longer waits for them (cia402_goodbye.hpp), 0.3 s at most; then drives back to NMT pre-operational.
  void shut_down(std::int64_t period_ns) noexcept;

  // What was sent and what came in, for the record and for the black box.
  void write_record(CycleRecord& record) const noexcept;
  void write_inputs(BoxCycle& entry) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  // Frames for one bus that go to its interface together.
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
  // Of the time after the last cycle: no fault, nor anything for the record, comes of it.
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
  std::uint64_t cycle_ = 0;     // counts on while saying goodbye: the heartbeat goes with it
  bool sends_torques_ = false;
};

}  // namespace proxarm::controller
