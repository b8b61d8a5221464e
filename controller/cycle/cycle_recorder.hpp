// Stores the output of a cycle: a record, which a ring passes to the thread that writes files, and an entry of the
// black box.
//
// A session without a black box writes to a box that stores nothing, so the cycle needn't check whether there is a
// black box. Nothing allocates, locks or throws after construction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/record/black_box.hpp"
#include "controller/record/cycle_record.hpp"
#include "models/base/spsc_ring.hpp"

namespace proxarm::controller {

class CycleRecorder {
 public:
  // `capacity`: largest number of records that wait in the ring until the writing thread pops them.
  explicit CycleRecorder(std::size_t capacity) : records_(capacity), entry_(&no_box_.begin(0)) {}
  CycleRecorder(const CycleRecorder&) = delete;
  CycleRecorder& operator=(const CycleRecorder&) = delete;

  // Sets the black box. Precondition: no cycle has run.
  void write_to(CycleBox& box) noexcept { box_ = &box; }

  // Begins a cycle with an empty record and an empty entry. If the black box wants a state, archive(StateArchive&)
  // writes the cycle's whole state to it.
  template <typename Archive>
  void begin(std::int64_t t_k_ns, Archive&& archive) noexcept {
    if (const std::span<std::byte> room = box_->state_room(); !room.empty()) {
      fieldbus::StateArchive state = fieldbus::StateArchive::writer(room);
      archive(state);
      if (state.whole()) box_->finish_state(state.bytes());
    }
    begin_entry(t_k_ns);
  }

  [[nodiscard]] CycleRecord& record() noexcept { return record_; }
  [[nodiscard]] BoxCycle& entry() noexcept { return *entry_; }
  void add_received(std::size_t bus, const fieldbus::TimedFrame& received) noexcept {
    box_->add({received.frame, received.time_ns, static_cast<std::uint8_t>(bus)});
  }
  void add_sent(std::size_t bus, const fieldbus::CanFrame& frame, std::int64_t now_ns,
                fieldbus::SendResult result) noexcept {
    box_->add({frame, now_ns, static_cast<std::uint8_t>(bus), true, result});
  }
  void add_status(std::size_t bus, const fieldbus::BusStatus& status) noexcept {
    if (bus < max_buses) entry_->buses[bus] = {status.state, status.receive_overflows};
  }
  // Ends the cycle. Precondition: record and entry are complete.
  void finish() noexcept;

  // The records, for the thread that writes files.
  [[nodiscard]] SpscRing<CycleRecord>& records() noexcept { return records_; }

 private:
  // A black box that stores nothing.
  class NoBox final : public CycleBox {
   public:
    [[nodiscard]] BoxCycle& begin(std::int64_t /*t_k_ns*/) noexcept override { return entry_; }
    void add(const BoxFrame& /*frame*/) noexcept override {}
    void finish() noexcept override {}
    [[nodiscard]] std::span<std::byte> state_room() noexcept override { return {}; }
    void finish_state(std::size_t /*bytes*/) noexcept override {}

   private:
    BoxCycle entry_;
  };

  void begin_entry(std::int64_t t_k_ns) noexcept;

  CycleRecord record_;
  SpscRing<CycleRecord> records_;
  NoBox no_box_;
  CycleBox* box_ = &no_box_;
  BoxCycle* entry_;  // entry of this cycle
};

}  // namespace proxarm::controller
