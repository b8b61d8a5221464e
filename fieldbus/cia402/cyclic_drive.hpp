// Interface of one axis' drive to the cycle: a CiA 402 drive on CAN (ServoDrive) or a drive on a Modbus line
// (ModbusDrive).
//
// A cycle: on_sync(); on_frame() for received frames; set_target_rad(); encode_rpdo(), send. These are noexcept and
// allocate nothing. Angles are the joint's; for a linear axis, metres.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/cia402/cia402_state.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

enum class DriveFault : std::uint8_t {
  none,
  state_fault,          // statusword reports fault or fault reaction active while operation is requested
  left_operation,       // the drive left operation enabled by itself (quick stop, disabled, ...)
  emergency,            // an EMCY that isn't a warning (canopen_emcy.hpp)
  heartbeat_lost,       // no heartbeat for drive_heartbeat_timeout_ms
  restarted,            // boot-up message: the drive was reset and has lost its configuration
  not_operational,      // an NMT command of another node took it out of operational
  pdo_short,            // a TPDO shorter than its mapping
  not_remote,           // statusword bit 9 is 0 in operation: the drive is under local control
  mode_changed,         // 6061h in the cell's `feedback` shows another mode in operation
  two_nodes,            // two TPDOs at each SYNC: two drives with one node number
  target_out_of_range,  // target not finite or beyond 32 bits; the previous one is kept
  modbus_timeout,       // no answer for the description's stale_after_s
  modbus_exception,     // the drive refuses a request with an exception code
  modbus_closed,        // the connection was closed or the serial device is gone
  modbus_wrong_unit,    // another unit answered
  modbus_malformed,     // invalid answer: incomplete, another function, wrong checksum
};

class CyclicDrive {
 public:
  virtual ~CyclicDrive() = default;

  [[nodiscard]] virtual const description::DriveDescription& description() const noexcept = 0;
  virtual void request(DriveGoal goal) noexcept = 0;
  // Begins a cycle: frames received before are no longer fresh.
  virtual void on_sync(std::int64_t now_ns) noexcept = 0;
  // True if the frame was this drive's.
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  // Sets a new target. False if it isn't taken: not following() yet, or fault target_out_of_range.
  virtual bool set_target_rad(double angle_rad) noexcept = 0;
  // The frame of this cycle; false if none is to be sent.
  virtual bool encode_rpdo(CanFrame& frame) noexcept = 0;

  [[nodiscard]] virtual bool fresh() const noexcept = 0;  // the feedback is as new as it can be
  [[nodiscard]] virtual std::uint32_t cycles_without_tpdo() const noexcept = 0;
  [[nodiscard]] virtual double feedback_period_s() const noexcept { return 0.0; }  // 0: it answers every cycle
  [[nodiscard]] virtual DriveState state() const noexcept = 0;
  [[nodiscard]] virtual bool following() const noexcept = 0;  // takes targets
  [[nodiscard]] virtual std::int32_t actual_counts() const noexcept = 0;
  [[nodiscard]] virtual double actual_rad() const noexcept = 0;
  // Motor torque as a share of the rated torque (6077h), signed like the joint; nullopt: not reported.
  [[nodiscard]] virtual std::optional<double> torque_share() const noexcept { return std::nullopt; }
  // Torque of the gear on the link, signed like the joint, in the latest answer; nullopt: not measured.
  [[nodiscard]] virtual std::optional<double> gear_torque_Nm() const noexcept { return std::nullopt; }
  [[nodiscard]] virtual std::int32_t target_counts() const noexcept = 0;
  [[nodiscard]] virtual double target_rad() const noexcept = 0;
  [[nodiscard]] virtual DriveFault fault() const noexcept = 0;  // the first one
  // After a reset: the next request for operation may find the drive in fault and then resets it.
  virtual void forget_fault() noexcept = 0;
  // State and fault in words; not for the cycle.
  [[nodiscard]] virtual std::string describe() const = 0;

  // All state that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // Input of the last on_sync() that came without a frame; when read back, the next on_sync() gets it.
  virtual void archive_input(StateArchive& /*state*/) noexcept {}

 protected:
  CyclicDrive() = default;
  CyclicDrive(const CyclicDrive&) = default;
  CyclicDrive(CyclicDrive&&) = default;
  CyclicDrive& operator=(const CyclicDrive&) = default;
  CyclicDrive& operator=(CyclicDrive&&) = default;
};

[[nodiscard]] const char* to_string(DriveFault fault) noexcept;

}  // namespace proxarm::fieldbus
