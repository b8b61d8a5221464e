// The cycle's interface to the drive of one axis: a CiA 402 drive on CAN (ServoDrive) or a drive on a Modbus line
// (ModbusDrive).
//
// In each cycle, call in this order: on_sync(); on_frame() for each received frame; set_target_rad(); encode_rpdo(),
// and send the frame. These functions are noexcept and allocate nothing. Angles are those of the joint in radians; for
// a linear axis they are positions in metres.
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
  state_fault,     // the statusword reports fault or fault reaction active while operation is requested
  left_operation,  // the drive left operation enabled by itself (quick stop, disabled, ...)
  emergency,       // the drive sent an EMCY that isn't a warning (canopen_emcy.hpp)
  heartbeat_lost,  // the drive sent no heartbeat for drive_heartbeat_timeout_ms
  restarted,       // the drive sent a boot-up message: it was reset and has lost its configuration
  // The drive's heartbeat shows another NMT state than operational, for example after an NMT command of another node.
  not_operational,
  pdo_short,            // a TPDO was shorter than its mapping
  not_remote,           // statusword bit 9 is 0 in operation: the drive is under local control
  mode_changed,         // 6061h (in the cell's `feedback`) shows another mode while the drive follows targets
  two_nodes,            // two TPDOs came at each SYNC: two drives have one node number
  target_out_of_range,  // the target isn't finite or doesn't fit 32 bits; the previous target is kept
  modbus_timeout,       // the drive sent no answer for the description's stale_after_s
  modbus_exception,     // the drive refused a request with an exception code
  modbus_closed,        // the connection was closed, or the serial device is gone
  modbus_wrong_unit,    // another unit than the drive answered
  modbus_malformed,     // the answer is invalid: incomplete, of another function, or with a wrong checksum
};

class CyclicDrive {
 public:
  virtual ~CyclicDrive() = default;

  [[nodiscard]] virtual const description::DriveDescription& description() const noexcept = 0;
  virtual void request(DriveGoal goal) noexcept = 0;
  // Begins a cycle. Frames received before no longer count as fresh.
  virtual void on_sync(std::int64_t now_ns) noexcept = 0;
  // True if this drive sent the frame.
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  // Sets a new target. False if the target isn't taken: the drive isn't following() yet, or the target is out of range
  // (fault target_out_of_range).
  virtual bool set_target_rad(double angle_rad) noexcept = 0;
  // Writes the frame of this cycle to `frame`; false if no frame is to be sent.
  virtual bool encode_rpdo(CanFrame& frame) noexcept = 0;

  // True if the feedback is as recent as the bus allows.
  [[nodiscard]] virtual bool fresh() const noexcept = 0;
  [[nodiscard]] virtual std::uint32_t cycles_without_tpdo() const noexcept = 0;
  // Period in which the drive answers; 0: it answers in every cycle.
  [[nodiscard]] virtual double feedback_period_s() const noexcept { return 0.0; }
  [[nodiscard]] virtual DriveState state() const noexcept = 0;
  // True if the drive takes targets.
  [[nodiscard]] virtual bool following() const noexcept = 0;
  [[nodiscard]] virtual std::int32_t actual_counts() const noexcept = 0;
  [[nodiscard]] virtual double actual_rad() const noexcept = 0;
  // Returns the motor torque as a share of the rated torque (6077h), with the sign of the joint; nullopt if the drive
  // doesn't report it.
  [[nodiscard]] virtual std::optional<double> torque_share() const noexcept { return std::nullopt; }
  // Returns the torque that the gear exerts on the link in the latest answer, with the sign of the joint; nullopt if it
  // isn't measured.
  [[nodiscard]] virtual std::optional<double> gear_torque_Nm() const noexcept { return std::nullopt; }
  [[nodiscard]] virtual std::int32_t target_counts() const noexcept = 0;
  [[nodiscard]] virtual double target_rad() const noexcept = 0;
  [[nodiscard]] virtual DriveFault fault() const noexcept = 0;  // the first fault that was raised
  // Must be called after a reset. If the next request for operation finds the drive in fault, that fault is reset.
  virtual void forget_fault() noexcept = 0;
  // Returns state and fault as text. Not for the cycle.
  [[nodiscard]] virtual std::string describe() const = 0;

  // Archives all state that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // Archives the input that the last on_sync() got from other sources than frames. When the archive is read back, the
  // next on_sync() gets this input.
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
