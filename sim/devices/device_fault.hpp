// Scripted faults of simulated devices, for tests and for practice.
//
// On the command line, a fault is written as DEVICE:KIND[=VALUE][@FROM[..UNTIL]]:
//   axis_3:silent                     the drive of axis_3 is silent from the start
//   axis_2:fault=0x4210@2s            the drive reports EMCY 4210h (temperature) two seconds after power on
//   axis_3:runaway=-0.5rad/s@2s       the drive runs away from its setpoints
//   sensor:frozen@1.5s..1.6s          the sensor repeats one sample for a tenth of a second
//   sensor:status=0x4000@3s           the sensor sets bit 14 of its status word
//   axis_1:holds=0x140002:255         object 1400h:02 is 255
// DEVICE is a joint's name in the cell, or "sensor". Times count from power on and have a unit. A permanent fault takes
// no times.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::sim {

enum class DeviceFaultKind : std::uint8_t {
  // Faults of drives
  drive_silent,    // "silent": the drive is disconnected from the bus; its firmware keeps running
  drive_fault,     // "fault": the drive trips with EMCY code VALUE
  device_type,     // "device_type": 1000h is VALUE; permanent
  object_missing,  // "lacks": object VALUE (index << 8 | sub-index) is missing; permanent
  object_fixed,    // "fixed": object VALUE can't be written; permanent
  // "holds" (OBJECT:CONTENT): object OBJECT has the value CONTENT from power on; permanent
  object_holds,
  // "refuses" (OBJECT:CONTENT): writing object OBJECT is aborted with CONTENT (default 0609 0030h); permanent
  value_refused,
  // "wants_bits": the drive reports that it follows targets only while controlword bits VALUE are set; permanent
  bits_wanted,
  // "mode_first": the drive refuses PDO mappings until 6060h has a mode; permanent
  mode_first,
  mode_late,       // "mode_late": 6061h shows the mode only while operation is enabled; permanent
  homed,           // "homed": the incremental encoder was homed before power on; permanent
  heartbeat_lost,  // "heartbeat": the drive sends no heartbeat
  sdo_silent,      // "sdo": the drive doesn't answer SDO requests
  period_fixed,    // "period": the drive refuses to change 60C2h while operation is enabled
  sto_open,        // "sto": STO is open, so the drive stays in "switch on disabled"
  bit_12_missing,  // "bit12": the drive never reports that it follows targets
  mode_changed,    // "mode": 6061h shows mode VALUE
  twin,            // "twin": another node with the drive's number also answers each SYNC
  sdo_late,        // "sdo_late": the drive answers SDO requests VALUE milliseconds later
  sdo_stray,       // "sdo_stray": the drive sends an answer for another object before each answer
  sdo_sizeless,    // "sdo_sizeless": the drive's read answers don't give their size
  sdo_doubled,     // "sdo_doubled": the drive sends each SDO answer twice
  guarding,        // "guarding": bit 7 of the drive's heartbeat toggles, as in node guarding
  boot_up,         // "boot_up": the drive sends a boot-up frame once and keeps working
  // "warning": the drive sends EMCY code VALUE with an empty error register and keeps working
  warning,
  sync_lost,     // "sync_lost": the drive misses one of VALUE SYNCs
  tpdo_bytes,    // "tpdo_bytes": the drive's transmit PDOs have VALUE bytes
  power_loss,    // "power": the drive is off, and on again at the end of the fault
  jammed,        // "jammed": the motor can't turn
  runaway,       // "runaway": the axis drifts from the setpoints at AMOUNT rad/s
  reversed,      // "reversed": the axis moves as far in the opposite direction
  ignored,       // "ignored": the drive ignores its setpoints
  weak,          // "weak": the motor's torque is limited to AMOUNT Nm at the joint
  offset,        // "offset": the reported position is AMOUNT rad too large
  stuck,         // "stuck": the reported position doesn't change
  torque_stuck,  // "torque_stuck": the measured gear torque repeats its last reading
  // A drive in torque mode can't have "runaway". A drive on a Modbus line can have "silent", "power", the faults from
  // "jammed" to "stuck", and the following faults:
  modbus_exception,       // "exception": each request is answered by exception VALUE
  modbus_lost,            // "lost": one of VALUE requests gets no answer
  modbus_closed,          // "closed": the connection is closed
  modbus_wrong_unit,      // "wrong_unit": the answers have the number of the next unit
  modbus_wrong_function,  // "wrong_function": the answers have another function code
  modbus_wrong_count,     // "wrong_count": the answers announce one register less
  modbus_half,            // "half_answer": the answers are cut in half
  modbus_low_first,       // "low_first": the drive's word order is the opposite of the file's
  modbus_forgets,         // "forgets": the drive acknowledges settings without storing them
  modbus_no_function_23,  // "no_function_23": the drive lacks function 23
  modbus_not_ready,       // "not_ready": the drive's status never shows ready
  modbus_not_driven,      // "not_driven": the drive's status never shows driven
  modbus_tripped,         // "tripped": the drive's status shows a fault
  // Faults of the sensor
  sensor_silent,    // "silent": the sensor answers no request
  samples_missing,  // "samples": the sensor answers all requests except polls
  frozen,           // "frozen": the sensor repeats its last sample
  half_sample,      // "half": the last frame of each sample is missing
  swapped,          // "swapped": the frames of each sample come in reverse order
  duplicated,       // "duplicated": each frame of a sample comes twice
  short_frames,     // "short": each frame of a sample lacks its last byte
  bad_checksum,     // "checksum": each sample's checksum is wrong
  saturated,        // "saturated": the first channel is at the end of its range
  lost,             // "lost": every VALUE-th sample frame is lost
  status,           // "status": bits VALUE are set in the status word
  channel_stuck,    // "channel": gauge or signal number VALUE, from 0, repeats its last value
  // "offset": the force along x of S is AMOUNT N too large; if it lasts a millisecond, it is a spike
  sensor_offset,
  drift,     // "drift": the force along x of S increases by AMOUNT N per second
  scale,     // "scale": all readings are multiplied by AMOUNT
  inverted,  // "inverted": all readings have the wrong sign
  turned,    // "turned": the sensor is mounted turned by 180° about z of S
  delay,     // "delay": the sensor answers VALUE microseconds later
};

struct DeviceFault {
  std::string device;
  DeviceFaultKind kind = DeviceFaultKind::drive_silent;
  std::uint32_t value = 0;
  std::uint32_t content = 0;  // CONTENT: the value of an object, or an abort code
  double amount = 0.0;        // AMOUNT; for a linear axis, read m for rad and N for Nm
  std::int64_t from_ns = 0;   // time since power on
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
};

// Kinds of devices as bits.
enum class FaultyDevice : std::uint8_t { can_drive = 1, modbus_drive = 2, sensor = 4 };

// Throws SetupError if a device of this kind can't have the fault. Without this check the fault would have no effect,
// and a test with it would seem to pass.
void require_known_fault(const DeviceFault& fault, FaultyDevice device);

// Parses the text of a fault. Throws SetupError if the kind is unknown, if a value is missing or superfluous, or if a
// time is invalid. The cell checks whether the device exists.
[[nodiscard]] DeviceFault parse_device_fault(std::string_view text);

}  // namespace proxarm::sim
