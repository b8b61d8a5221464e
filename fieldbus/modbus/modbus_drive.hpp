// One drive on a Modbus line: what the cycle sees of it, and what the line's worker sends to it and makes of its
// answers.
//
// The cycle runs at its own period T, the line at P, several times as long and without any relation to it. The worker
// resamples: setpoint k was meant for t_k + 2T (when a drive on CAN would be there), and what is sent at t is reached
// one exchange later, so
//   counts = target + v (t + P − (t_k + 2T)),  v = (target(k) − target(k−1))/T,
// extrapolated by two exchanges at most and kept in the joint's range. The speed that goes with it,
// |counts − last counts|/P, makes the drive arrive when the next one comes, neither before nor late.
//
// A setpoint older than stale_after_s means that the cycle is gone: nothing is sent any more, and the drive stops by
// its own communication timeout. Two threads: the cycle's, which uses the functions of CyclicDrive, and the worker's.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "fieldbus/cia402/cia402_units.hpp"
#include "fieldbus/cia402/cyclic_drive.hpp"
#include "fieldbus/modbus/modbus_client.hpp"
#include "models/base/triple_buffer.hpp"
#include "models/description/modbus_drive.hpp"

namespace proxarm::fieldbus {

class ModbusDrive final : public CyclicDrive {
 public:
  // `period_ns`: of the cycle. Throws SetupError where the cell's drive can't be what a register holds.
  ModbusDrive(const description::DriveDescription& drive, const description::ModbusDriveDescription& registers,
              std::int64_t period_ns);

  // ---- the worker's ----
  // One exchange, begun at now_ns, the line coming round to this drive every exchange_ns. False: it had nothing to
  // send, since the cycle is gone.
  bool exchange(ModbusClient& client, std::int64_t now_ns, std::int64_t exchange_ns) noexcept;
  // Before the cycle: settings written and read back, position read. Throws SetupError, also where that position is out
  // of the joint's range and would be in it with the words in the other order.
  void start_up(ModbusClient& client, std::int64_t now_ns);
  // Whether that position shows that the file's word order is the drive's: in the other one it would be out of range. A
  // position whose words are equal, such as 0, shows nothing; no later one would, since what is sent and what is read
  // would both be the wrong way round.
  [[nodiscard]] bool word_order_shown() const noexcept { return word_order_shown_; }

  // ---- the cycle's ----
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return description_; }
  [[nodiscard]] const description::ModbusDriveDescription& registers() const noexcept { return registers_; }
  void request(DriveGoal goal) noexcept override { goal_ = goal; }
  void on_sync(std::int64_t now_ns) noexcept override;
  bool on_frame(const CanFrame&, std::int64_t) noexcept override { return false; }
  bool set_target_rad(double angle_rad) noexcept override;
  bool encode_rpdo(CanFrame&) noexcept override { return false; }

  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }
  // Always 0: a drive that is silent for stale_after_s has the fault modbus_timeout.
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return 0; }
  [[nodiscard]] double feedback_period_s() const noexcept override {
    return feedback_.rate_Hz > 0.0 ? 1.0 / feedback_.rate_Hz : registers_.stale_after_s;
  }
  [[nodiscard]] DriveState state() const noexcept override { return state_; }
  [[nodiscard]] bool following() const noexcept override { return following_; }
  [[nodiscard]] std::int32_t actual_counts() const noexcept override { return feedback_.position_counts; }
  [[nodiscard]] double actual_rad() const noexcept override { return scale_.angle_rad(feedback_.position_counts); }
  [[nodiscard]] std::int32_t target_counts() const noexcept override { return target_counts_; }
  [[nodiscard]] double target_rad() const noexcept override { return scale_.angle_rad(target_counts_); }
  [[nodiscard]] DriveFault fault() const noexcept override { return fault_; }
  void forget_fault() noexcept override { fault_ = DriveFault::none; }
  [[nodiscard]] std::string describe() const override;
  void archive(StateArchive& state) noexcept override {
    state(feedback_, goal_, state_, fault_, now_ns_, target_counts_, previous_target_, fresh_, following_);
  }
  void archive_input(StateArchive& state) noexcept override;
  // Mean over the last exchanges that were answered, 1/s; 0: none yet.
  [[nodiscard]] double achieved_rate_Hz() const noexcept { return feedback_.rate_Hz; }

 private:
  // From the cycle to the worker.
  struct Setpoint {
    std::int64_t time_ns = 0;  // t_k
    double counts = 0.0;
    double counts_per_s = 0.0;
    bool drive_it = false;  // the power stage is wanted
    bool follow = false;    // go to `counts`; else stay where it is
  };
  // From the worker to the cycle.
  struct Feedback {
    std::int64_t time_ns = 0;
    std::int32_t position_counts = 0;
    std::uint32_t status = 0;
    DriveFault fault = DriveFault::none;
    DriveFault noise = DriveFault::none;  // what is wrong with the latest answer, while that is tolerated
    int exception = 0;
    double rate_Hz = 0.0;
  };

  [[nodiscard]] bool has_control() const noexcept;
  [[nodiscard]] double resampled(const Setpoint& setpoint, std::int64_t now_ns,
                                 std::int64_t exchange_ns) const noexcept;
  std::size_t encode(const Setpoint& setpoint, std::int64_t now_ns, std::int64_t exchange_ns,
                     std::span<std::uint16_t> out) noexcept;
  ModbusResult talk(ModbusClient& client, std::span<const std::uint16_t> command) noexcept;
  void judge_word_order();
  [[nodiscard]] bool in_range(std::int32_t counts) const noexcept;
  void note(ModbusResult result, int exception, std::int64_t now_ns) noexcept;
  [[nodiscard]] std::int32_t field(std::span<const std::uint16_t> values, std::uint16_t first,
                                   const description::ModbusField& field) const noexcept;
  void put(std::span<std::uint16_t> out, int registers, std::int64_t value) const noexcept;
  void judge() noexcept;
  void raise(DriveFault fault) noexcept;

  description::DriveDescription description_;
  description::ModbusDriveDescription registers_;
  CountScale scale_;
  std::int64_t period_ns_, stale_ns_;
  double low_counts_, high_counts_;
  TripleBuffer<Setpoint> setpoints_;
  TripleBuffer<Feedback> feedbacks_;

  // The worker's
  Setpoint setpoint_;
  Feedback answer_;
  std::array<std::uint16_t, modbus_most_read> read_{};
  double sent_counts_ = 0.0;
  bool cycling_ = false, status_known_ = false, answered_ = false, word_order_shown_ = false;
  std::int64_t last_answer_ns_ = 0;
  int exchanges_since_status_ = 0;

  // The cycle's
  Feedback feedback_;
  DriveGoal goal_ = DriveGoal::none;
  DriveState state_ = DriveState::unknown;
  DriveFault fault_ = DriveFault::none;
  std::int64_t now_ns_ = 0;
  std::int32_t target_counts_ = 0;
  double previous_target_ = 0.0;
  bool fresh_ = false, following_ = false;
};

}  // namespace proxarm::fieldbus
