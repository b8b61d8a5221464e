// What goes wrong with a simulated device, and when: a script of faults for tests and for trying out one's own nerves.
//
// As text, for the command line:  DEVICE:KIND[=VALUE][@FROM[..UNTIL]]
//   axis_3:silent                     drive of axis_3 says nothing, from the start
//   axis_2:fault=0x4210@2s            drive reports EMCY 4210h (temperature) two seconds after power on
//   axis_3:runaway=-0.5rad/s@2s       drive goes off by itself
//   sensor:frozen@1.5s..1.6s          repeats one sample for a tenth of a second
//   sensor:status=0x4000@3s
//   axis_1:holds=0x140002:255         object 1400h:02 is 255
// DEVICE is a joint's name in the cell, or "sensor". Times count from power on and have a unit.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::sim {

enum class DeviceFaultKind : std::uint8_t {
  // Drives
  drive_silent,    // "silent": its bus connection is gone both ways; the firmware runs on
  drive_fault,     // "fault": trips with EMCY code VALUE
  device_type,     // "device_type": 1000h is VALUE; always, no times
  object_missing,  // "lacks": it has no object VALUE (index << 8 | sub-index); always, no times
  object_fixed,    // "fixed": object VALUE can't be written; always, no times
  object_holds,    // "holds": object VALUE has CONTENT from power on (OBJECT:CONTENT); always, no times
  value_refused,   // "refuses": writing object VALUE is aborted by CONTENT (0609 0030h, its value); always, no times
  bits_wanted,     // "wants_bits": says that it follows only while controlword bits VALUE are set; always, no times
  mode_first,      // "mode_first": takes no mapping of PDOs until 6060h has a mode; always, no times
  mode_late,       // "mode_late": 6061h shows the mode only once operation is enabled; always, no times
  homed,           // "homed": with an incremental encoder, it was homed before; always, no times
  heartbeat_lost,  // "heartbeat": no heartbeat leaves
  sdo_silent,      // "sdo": SDO requests stay unanswered
  period_fixed,    // "period": refuses another 60C2h while operation is enabled
  sto_open,        // "sto": STO is open, so it stays in "switch on disabled"
  bit_12_missing,  // "bit12": never says that it follows its targets
  mode_changed,    // "mode": 6061h shows mode VALUE
  twin,            // "twin": another node with the same number answers each SYNC, too
  sdo_late,        // "sdo_late": answers SDO requests VALUE milliseconds later
  sdo_stray,       // "sdo_stray": sends an answer for another object before each answer
  sdo_sizeless,    // "sdo_sizeless": its read answers don't say how many bytes count
  sdo_doubled,     // "sdo_doubled": sends each SDO answer twice
  guarding,        // "guarding": its heartbeat's bit 7 toggles, as that of node guarding does
  boot_up,         // "boot_up": says boot-up once, and carries on
  warning,         // "warning": says EMCY code VALUE with no bit in its error register, and carries on
  sync_lost,       // "sync_lost": misses one of VALUE SYNCs
  tpdo_bytes,      // "tpdo_bytes": its transmit PDOs have VALUE bytes
  power_loss,      // "power": off, and on again at the end
  jammed,          // "jammed": the motor can't turn
  runaway,         // "runaway": goes off from its setpoints at AMOUNT rad/s
  reversed,        // "reversed": goes from where it is as far to the other side as it is told
  ignored,         // "ignored": stays where it is, whatever it is told
  weak,            // "weak": its motor gives no more than AMOUNT Nm, at the joint
  offset,          // "offset": the position that it reports is AMOUNT rad too large
  stuck,           // "stuck": it reports one position whatever it does
  torque_stuck,    // "torque_stuck": what it measures of its gear's torque repeats its last reading
  // Those that spoil a position's way (runaway) are no fault of a drive that takes torques.
  // Drives on a Modbus line, which know "silent", "power", "jammed" and what follows that as well
  modbus_exception,       // "exception": each request is answered by exception VALUE
  modbus_lost,            // "lost": one of VALUE requests has no answer
  modbus_closed,          // "closed": the connection is closed
  modbus_wrong_unit,      // "wrong_unit": its answers bear the next unit's number
  modbus_wrong_function,  // "wrong_function": its answers bear another function's
  modbus_wrong_count,     // "wrong_count": its answers say that they have a register less
  modbus_half,            // "half_answer": its answers end in the middle
  modbus_low_first,       // "low_first": its words are in the other order than its file says
  modbus_forgets,         // "forgets": it acknowledges settings and doesn't keep them
  modbus_no_function_23,  // "no_function_23": it doesn't know that function
  modbus_not_ready,       // "not_ready": its status never says that it is ready
  modbus_not_driven,      // "not_driven": its status never says that it is driven
  modbus_tripped,         // "tripped": its status says that it has a fault
  // Sensor
  sensor_silent,    // "silent": answers nothing
  samples_missing,  // "samples": answers everything but polls
  frozen,           // "frozen": repeats its last sample
  half_sample,      // "half": the second frame of a sample is missing
  swapped,          // "swapped": the second frame comes first
  duplicated,       // "duplicated": each frame comes twice
  short_frames,     // "short": each frame lacks a byte
  bad_checksum,     // "checksum": each sample's checksum is wrong
  saturated,        // "saturated": the first channel is at its rail
  lost,             // "lost": every VALUE-th frame of samples is lost
  status,           // "status": bits VALUE in the status word
  channel_stuck,    // "channel": gauge or signal number VALUE, from 0, repeats its last value
  sensor_offset,    // "offset": AMOUNT N too much along x of S; for a millisecond it is a spike
  drift,            // "drift": AMOUNT N more along x of S each second
  scale,            // "scale": all readings are AMOUNT times what they should be
  inverted,         // "inverted": all readings have the wrong sign
  turned,           // "turned": mounted turned by half a turn about z of S
  delay,            // "delay": answers VALUE microseconds later
};

struct DeviceFault {
  std::string device;
  DeviceFaultKind kind = DeviceFaultKind::drive_silent;
  std::uint32_t value = 0;
  std::uint32_t content = 0;  // of an object: its value, or the abort code
  double amount = 0.0;        // of a linear axis, read m for rad and N for Nm
  std::int64_t from_ns = 0;   // since power on
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
};

// What a device may be, as bits.
enum class FaultyDevice : std::uint8_t { can_drive = 1, modbus_drive = 2, sensor = 4 };

// Throws SetupError where a device of this kind doesn't know the fault: it would do nothing, and a drill with it would
// seem to pass.
void require_known_fault(const DeviceFault& fault, FaultyDevice device);

// Throws SetupError: unknown kind, missing or superfluous value, bad time. Whether the device exists is known only to
// the cell.
[[nodiscard]] DeviceFault parse_device_fault(std::string_view text);

}  // namespace proxarm::sim
