// Scripted faults of simulated devices, for tests and for practice.
//
// As text, for the command line: DEVICE:KIND[=VALUE][@FROM[..UNTIL]]
//   axis_3:silent                     drive of axis_3 is silent from the start
//   axis_2:fault=0x4210@2s            drive reports EMCY 4210h (temperature) two seconds after power on
//   axis_3:runaway=-0.5rad/s@2s       drive runs away from its setpoints
//   sensor:frozen@1.5s..1.6s          repeats one sample for a tenth of a second
//   sensor:status=0x4000@3s
//   axis_1:holds=0x140002:255         object 1400h:02 is 255
// DEVICE is a joint's name in the cell, or "sensor". Times count from power on and have a unit. Permanent faults take
// no times.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::sim {

enum class DeviceFaultKind : std::uint8_t {
  // Drives
  drive_silent,    // "silent": disconnected from the bus; the firmware runs on
  drive_fault,     // "fault": trips with EMCY code VALUE
  device_type,     // "device_type": 1000h is VALUE; permanent
  object_missing,  // "lacks": object VALUE (index << 8 | sub-index) is missing; permanent
  object_fixed,    // "fixed": object VALUE can't be written; permanent
  object_holds,    // "holds": object VALUE has CONTENT from power on (OBJECT:CONTENT); permanent
  value_refused,   // "refuses": writing object VALUE is aborted with CONTENT (default 0609 0030h); permanent
  bits_wanted,     // "wants_bits": reports that it follows only while controlword bits VALUE are set; permanent
  mode_first,      // "mode_first": refuses PDO mappings until 6060h has a mode; permanent
  mode_late,       // "mode_late": 6061h shows the mode only once operation is enabled; permanent
  homed,           // "homed": its incremental encoder was homed before; permanent
  heartbeat_lost,  // "heartbeat": sends no heartbeat
  sdo_silent,      // "sdo": doesn't answer SDO requests
  period_fixed,    // "period": refuses to change 60C2h while operation is enabled
  sto_open,        // "sto": STO is open, so it stays in "switch on disabled"
  bit_12_missing,  // "bit12": never reports that it follows targets
  mode_changed,    // "mode": 6061h shows mode VALUE
  twin,            // "twin": another node with the same number also answers each SYNC
  sdo_late,        // "sdo_late": answers SDO requests VALUE milliseconds later
  sdo_stray,       // "sdo_stray": sends an answer for another object before each answer
  sdo_sizeless,    // "sdo_sizeless": its read answers don't give their size
  sdo_doubled,     // "sdo_doubled": sends each SDO answer twice
  guarding,        // "guarding": bit 7 of its heartbeat toggles, as in node guarding
  boot_up,         // "boot_up": sends boot-up once, and works on
  warning,         // "warning": sends EMCY code VALUE with an empty error register, and works on
  sync_lost,       // "sync_lost": misses one of VALUE SYNCs
  tpdo_bytes,      // "tpdo_bytes": its transmit PDOs have VALUE bytes
  power_loss,      // "power": off, and on again at the end
  jammed,          // "jammed": the motor can't turn
  runaway,         // "runaway": drifts from its setpoints at AMOUNT rad/s
  reversed,        // "reversed": moves as far in the opposite direction
  ignored,         // "ignored": ignores its setpoints
  weak,            // "weak": its motor torque is limited to AMOUNT Nm, at the joint
  offset,          // "offset": its reported position is AMOUNT rad too large
  stuck,           // "stuck": its reported position doesn't change
  torque_stuck,    // "torque_stuck": its measured gear torque repeats the last reading
  // A drive in torque mode can't have "runaway". Drives on a Modbus line have "silent", "power", "jammed" to "stuck",
  // and these:
  modbus_exception,       // "exception": each request is answered by exception VALUE
  modbus_lost,            // "lost": one of VALUE requests gets no answer
  modbus_closed,          // "closed": the connection is closed
  modbus_wrong_unit,      // "wrong_unit": its answers have the next unit's number
  modbus_wrong_function,  // "wrong_function": its answers have another function code
  modbus_wrong_count,     // "wrong_count": its answers announce one register less
  modbus_half,            // "half_answer": its answers are cut in half
  modbus_low_first,       // "low_first": its word order is the opposite of its file's
  modbus_forgets,         // "forgets": acknowledges settings without storing them
  modbus_no_function_23,  // "no_function_23": lacks that function
  modbus_not_ready,       // "not_ready": its status never shows ready
  modbus_not_driven,      // "not_driven": its status never shows driven
  modbus_tripped,         // "tripped": its status shows a fault
  // Sensor
  sensor_silent,    // "silent": answers nothing
  samples_missing,  // "samples": answers all requests but polls
  frozen,           // "frozen": repeats its last sample
  half_sample,      // "half": the second frame of a sample is missing
  swapped,          // "swapped": the second frame comes first
  duplicated,       // "duplicated": each frame comes twice
  short_frames,     // "short": each frame lacks a byte
  bad_checksum,     // "checksum": each sample's checksum is wrong
  saturated,        // "saturated": the first channel is at the end of its range
  lost,             // "lost": every VALUE-th sample frame is lost
  status,           // "status": sets bits VALUE in the status word
  channel_stuck,    // "channel": gauge or signal number VALUE, from 0, repeats its last value
  sensor_offset,    // "offset": AMOUNT N too much along x of S; lasting a millisecond, a spike
  drift,            // "drift": increases by AMOUNT N per second along x of S
  scale,            // "scale": all readings are multiplied by AMOUNT
  inverted,         // "inverted": all readings have the wrong sign
  turned,           // "turned": mounted turned by 180° about z of S
  delay,            // "delay": answers VALUE microseconds later
};

struct DeviceFault {
  std::string device;
  DeviceFaultKind kind = DeviceFaultKind::drive_silent;
  std::uint32_t value = 0;
  std::uint32_t content = 0;  // value of an object, or the abort code
  double amount = 0.0;        // for a linear axis, read m for rad and N for Nm
  std::int64_t from_ns = 0;   // since power on
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
};

// Kinds of devices, as bits.
enum class FaultyDevice : std::uint8_t { can_drive = 1, modbus_drive = 2, sensor = 4 };

// Throws SetupError if a device of this kind can't have the fault. It would have no effect, and a test with it would
// seem to pass.
void require_known_fault(const DeviceFault& fault, FaultyDevice device);

// Throws SetupError: unknown kind, missing or superfluous value, invalid time. Whether the device exists is checked by
// the cell.
[[nodiscard]] DeviceFault parse_device_fault(std::string_view text);

}  // namespace proxarm::sim
