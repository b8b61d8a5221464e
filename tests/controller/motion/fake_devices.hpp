// Drives, a sensor and a bus that do what a test says, for parts of the cycle without a far end.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "controller/motion/cycle_parts.hpp"
#include "controller/supervision/alarm.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/cia402/cyclic_drive.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/description/cell.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller::testing {

inline description::Cell default_cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

struct FakeDrive final : fieldbus::CyclicDrive {
  explicit FakeDrive(description::DriveDescription its) : own(std::move(its)) {}
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return own; }
  void request(fieldbus::DriveGoal wanted) noexcept override { goal = wanted; }
  void on_sync(std::int64_t) noexcept override { ++syncs; }
  bool on_frame(const fieldbus::CanFrame& frame, std::int64_t) noexcept override { return frame.id == takes_id; }
  bool set_target_rad(double wanted_rad) noexcept override {
    told_rad = wanted_rad;
    return true;
  }
  bool encode_rpdo(fieldbus::CanFrame& frame) noexcept override {
    frame = {.id = sends_id};
    return sends_id != 0;
  }
  [[nodiscard]] bool fresh() const noexcept override { return is_fresh; }
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return silent_cycles; }
  [[nodiscard]] double feedback_period_s() const noexcept override { return answers_every_s; }
  [[nodiscard]] fieldbus::DriveState state() const noexcept override { return its_state; }
  [[nodiscard]] bool following() const noexcept override { return follows; }
  [[nodiscard]] std::int32_t actual_counts() const noexcept override { return 11; }
  [[nodiscard]] double actual_rad() const noexcept override { return angle_rad; }
  [[nodiscard]] std::int32_t target_counts() const noexcept override { return 22; }
  [[nodiscard]] double target_rad() const noexcept override { return told_rad; }
  [[nodiscard]] fieldbus::DriveFault fault() const noexcept override { return its_fault; }
  void forget_fault() noexcept override { its_fault = fieldbus::DriveFault::none; }
  [[nodiscard]] std::string describe() const override { return own.joint; }
  void archive(fieldbus::StateArchive& state) noexcept override { state(angle_rad); }

  description::DriveDescription own;
  bool is_fresh = true, follows = true;
  double angle_rad = 0.0, told_rad = 0.0, answers_every_s = 0.0;
  std::uint32_t silent_cycles = 0, takes_id = 0, sends_id = 0;
  int syncs = 0;
  fieldbus::DriveState its_state = fieldbus::DriveState::operation_enabled;
  fieldbus::DriveGoal goal = fieldbus::DriveGoal::none;
  fieldbus::DriveFault its_fault = fieldbus::DriveFault::none;
};

struct FakeSensor final : fieldbus::ForceSensor {
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override { return {0x300}; }
  void start(fieldbus::CanNetwork&, std::size_t, const fieldbus::FrameHandler&) override {}
  [[nodiscard]] std::string identity() const override { return "a fake"; }
  bool poll(std::int64_t, fieldbus::CanFrame& frame) noexcept override {
    frame = {.id = 0x310};
    return true;
  }
  bool on_frame(const fieldbus::CanFrame& frame, std::int64_t) noexcept override {
    if (frame.id != 0x300) return false;
    is_fresh = true;
    return true;
  }
  [[nodiscard]] bool fresh() const noexcept override { return is_fresh; }
  [[nodiscard]] const fieldbus::ForceSample& latest() const noexcept override { return sample; }
  void archive(fieldbus::StateArchive& state) noexcept override { state(sample); }
  [[nodiscard]] std::string describe_status(std::uint32_t) const override { return ""; }

  bool is_fresh = true;
  fieldbus::ForceSample sample{.healthy = true};
};

// Drives of a cell, where its arm starts.
struct FakeDrives {
  explicit FakeDrives(const description::Cell& cell, const models::Arm& arm) {
    for (std::size_t i = 0; i < cell.drives.size(); ++i) {
      auto drive = std::make_unique<FakeDrive>(cell.drives[i]);
      drive->angle_rad = drive->told_rad = arm.start_rad()[static_cast<Eigen::Index>(i)];
      fakes.push_back(drive.get());
      fieldbus::CyclicDrive& same = *drive;
      on_bus.push_back({std::move(drive), same, 0});
    }
  }
  FakeDrive& operator[](std::size_t i) { return *fakes[i]; }

  std::vector<FakeDrive*> fakes;
  std::vector<DriveOnBus> on_bus;
};

struct FakeBus final : fieldbus::CanBus {
  fieldbus::SendResult send(const fieldbus::CanFrame& frame) noexcept override {
    sent.push_back(frame.id);
    return result;
  }
  void send_all(std::span<const fieldbus::CanFrame> frames, std::int64_t now_ns,
                fieldbus::SendResult* results) noexcept override {
    ++batches;
    CanBus::send_all(frames, now_ns, results);
  }
  bool receive(fieldbus::TimedFrame& out) noexcept override {
    if (waiting.empty()) return false;
    out = {{.id = waiting.front()}, 0};
    waiting.pop_front();
    return true;
  }
  [[nodiscard]] const fieldbus::BusStatus& status() const noexcept override { return its_status; }
  [[nodiscard]] const std::string& name() const noexcept override { return its_name; }

  std::vector<std::uint32_t> sent;
  std::deque<std::uint32_t> waiting;
  fieldbus::SendResult result = fieldbus::SendResult::sent;
  fieldbus::BusStatus its_status;
  std::string its_name = "bus";
  int batches = 0;
};

struct FakeNetwork final : fieldbus::CanNetwork {
  explicit FakeNetwork(std::size_t count) : buses(count) {}
  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses.size(); }
  [[nodiscard]] fieldbus::CanBus& bus(std::size_t index) noexcept override { return buses[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return 0; }
  void sleep_until(std::int64_t) noexcept override {}
  bool wait_for_frame(std::int64_t) noexcept override {
    ++waits;
    for (const FakeBus& bus : buses) {
      if (!bus.waiting.empty()) return true;
    }
    return false;
  }

  std::deque<FakeBus> buses;
  int waits = 0;
};

// A supervisor in a phase, and the alarm to it.
struct Watched {
  Supervisor supervisor;
  std::uint64_t cycle = 5;
  Alarm alarm{supervisor, cycle};

  void bring_to_rendering() {
    for (const Event event : {Event::begin, Event::enabled, Event::tared}) supervisor.handle(event);
  }
  [[nodiscard]] std::uint32_t times(Fault fault) const { return supervisor.notice(fault).times; }
};

}  // namespace proxarm::controller::testing
