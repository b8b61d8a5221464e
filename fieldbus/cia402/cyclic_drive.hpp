// One axis' drive as the cycle sees it, whatever wire it is on: a CiA 402 drive on CAN (ServoDrive) or a drive on a
// Modbus line (ModbusDrive).
//
// A cycle: on_sync(); on_frame() for what comes in; set_target_rad(); encode_rpdo(), send. All of it is noexcept and
// allocates nothing. Angles are the joint's; of a linear axis, metres.
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
  state_fault,          // statusword says fault or fault reaction active, while operation was wanted
  left_operation,       // the drive left operation enabled by itself (quick stop, disabled, ...)
  emergency,            // an EMCY that is no warning (canopen_emcy.hpp)
  heartbeat_lost,       // no heartbeat for drive_heartbeat_timeout_ms
  restarted,            // boot-up message: the drive was reset, and has lost its configuration
  not_operational,      // someone else's NMT command took it out of operational
  pdo_short,            // a TPDO shorter than its mapping
  not_remote,           // statusword bit 9 is 0 in operation: the drive is under local control
  mode_changed,         // 6061h shows another mode in operation, where the cell's `feedback` has it
  two_nodes,            // two TPDOs at each SYNC: two drives with one node number
  target_out_of_range,  // a target that isn't finite or doesn't fit 32 bits; the one before is kept
  modbus_timeout,       // no answer for the description's stale_after_s
  modbus_exception,     // the drive refuses a request with an exception code
  modbus_closed,        // the connection was closed or the serial device is gone
  modbus_wrong_unit,    // somebody else answered
  modbus_malformed,     // an answer that isn't one to the request: half a response, another function, a bad checksum
};

class CyclicDrive {
 public:
  virtual ~CyclicDrive() = default;

  [[nodiscard]] virtual const description::DriveDescription& description() const noexcept = 0;
  virtual void request(DriveGoal goal) noexcept = 0;
  // A cycle begins: what was received before it is no longer fresh.
  virtual void on_sync(std::int64_t now_ns) noexcept = 0;
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;  // true when it was this drive's
  // Takes a new target; false where none is taken: not driven yet, or fault target_out_of_range.
  virtual bool set_target_rad(double angle_rad) noexcept = 0;
  // The frame of this cycle; false where none is to be sent.
  virtual bool encode_rpdo(CanFrame& frame) noexcept = 0;

  [[nodiscard]] virtual bool fresh() const noexcept = 0;  // what is known of it is as new as it can be
  [[nodiscard]] virtual std::uint32_t cycles_without_tpdo() const noexcept = 0;
  [[nodiscard]] virtual double feedback_period_s() const noexcept { return 0.0; }  // 0: it answers every cycle
  [[nodiscard]] virtual DriveState state() const noexcept = 0;
  [[nodiscard]] virtual bool following() const noexcept = 0;  // takes targets
  [[nodiscard]] virtual std::int32_t actual_counts() const noexcept = 0;
  [[nodiscard]] virtual double actual_rad() const noexcept = 0;
  // The motor's torque as a share of the rated one (6077h), by the sense of the joint; none: the drive doesn't tell it.
  [[nodiscard]] virtual std::optional<double> torque_share() const noexcept { return std::nullopt; }
  // Of the joint's gear on its link, by the joint's sense, as its latest answer says; none: it isn't measured.
  [[nodiscard]] virtual std::optional<double> gear_torque_Nm() const noexcept { return std::nullopt; }
  [[nodiscard]] virtual std::int32_t target_counts() const noexcept = 0;
  [[nodiscard]] virtual double target_rad() const noexcept = 0;
  [[nodiscard]] virtual DriveFault fault() const noexcept = 0;  // the first one
  // A reset: the next request for operation may find it in a fault again, and resets that on the way.
  virtual void forget_fault() noexcept = 0;
  // State and fault in words; not for the cycle.
  [[nodiscard]] virtual std::string describe() const = 0;

  // All that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // What came in at the last on_sync() by another way than a frame; read back, it comes in at the next one.
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
