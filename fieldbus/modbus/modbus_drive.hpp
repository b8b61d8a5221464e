// One drive on a Modbus line. The cycle uses it through CyclicDrive; the worker thread sends its commands and evaluates
// its answers.
//
// The cycle runs with period T. Exchanges on the line have the period P, which is several times T and isn't
// synchronised with the cycle. The worker therefore resamples the setpoints:
// 1. Setpoint k, computed at t_k, was meant to be reached at t_k + 2T, when a drive on CAN would reach it.
// 2. A command that is sent at time t is reached one exchange later, at t + P.
// 3. So the setpoint is extrapolated from t_k + 2T to t + P:
//   counts = target + v (t + P − (t_k + 2T)),  v = (target(k) − target(k−1))/T
// The extrapolation is limited to two exchanges, and counts are clamped to the joint's range. The commanded speed
// |counts − last counts|/P makes the drive arrive when the next command comes.
//
// If the setpoint is older than stale_after_s, the cycle has stopped. The worker then sends nothing more, and the drive
// stops by its communication timeout.
//
// Two threads use this class: the cycle's thread, through the functions of CyclicDrive, and the worker thread.
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
  // `period_ns` is the period of the cycle. Throws SetupError if the drive's values don't fit into its registers.
  ModbusDrive(const description::DriveDescription& drive, const description::ModbusDriveDescription& registers,
              std::int64_t period_ns);

  // Makes one exchange, which begins at now_ns. exchange_ns is the time between two exchanges with this drive. False if
  // nothing was sent because the cycle has stopped.
  bool exchange(ModbusClient& client, std::int64_t now_ns, std::int64_t exchange_ns) noexcept;
  // Must be called before the cycle. Writes the settings and reads them back, then reads the position. Throws
  // SetupError if that fails. Also throws if the position is out of the joint's range but would be within the range in
  // the other word order.
  void start_up(ModbusClient& client, std::int64_t now_ns);
  // True if the position that was read at start proves the file's word order to be the drive's. It does if the position
  // would be out of range in the other word order. A position with two equal words, such as 0, proves nothing. Later
  // positions prove nothing either, because a wrong order would swap the words of written and read values alike.
  [[nodiscard]] bool word_order_shown() const noexcept { return word_order_shown_; }

  // ---- cycle thread ----
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return description_; }
  [[nodiscard]] const description::ModbusDriveDescription& registers() const noexcept { return registers_; }
  void request(DriveGoal goal) noexcept override { goal_ = goal; }
  void on_sync(std::int64_t now_ns) noexcept override;
  bool on_frame(const CanFrame&, std::int64_t) noexcept override { return false; }
  bool set_target_rad(double angle_rad) noexcept override;
  bool encode_rpdo(CanFrame&) noexcept override { return false; }

  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }
  // Returns 0. A drive that is silent for stale_after_s gets the fault modbus_timeout instead.
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
  // Returns the mean rate of the last answered exchanges in 1/s; 0 before the first answered exchange.
  [[nodiscard]] double achieved_rate_Hz() const noexcept { return feedback_.rate_Hz; }

 private:
  // What the cycle passes to the worker.
  struct Setpoint {
    std::int64_t time_ns = 0;  // time t_k at which the setpoint was computed
    double counts = 0.0;
    double counts_per_s = 0.0;
    bool drive_it = false;  // true: the power stage shall be on
    bool follow = false;    // true: the drive shall go to `counts`; false: it shall stay where it is
  };
  // What the worker passes to the cycle.
  struct Feedback {
    std::int64_t time_ns = 0;
    std::int32_t position_counts = 0;
    std::uint32_t status = 0;
    DriveFault fault = DriveFault::none;
    DriveFault noise = DriveFault::none;  // defect of the latest answer, as long as it is tolerated
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

  // Used by the worker thread.
  Setpoint setpoint_;
  Feedback answer_;
  std::array<std::uint16_t, modbus_most_read> read_{};
  double sent_counts_ = 0.0;
  bool cycling_ = false, status_known_ = false, answered_ = false, word_order_shown_ = false;
  std::int64_t last_answer_ns_ = 0;
  int exchanges_since_status_ = 0;

  // Used by the cycle thread.
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
