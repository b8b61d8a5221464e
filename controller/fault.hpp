// What can go wrong while a session runs, and what the user is told of it.
//
// Set-up mistakes throw SetupError before anything moves; an active limit is no fault and has flags of its own. A fault
// is latched by the supervisor at the first cycle that sees it, ends rendering with a controlled stop, and ends the run
// with exit status 1.
#pragma once

#include <cstdint>
#include <string>

namespace proxarm::controller {

enum class Fault : std::uint8_t {
  none,
  sensor_lost,          // no complete sample for more than max_missed_samples cycles: controlled stop
  sensor_status,        // the sensor's status word reports an error: controlled stop
  sensor_saturated,     // a gauge at its rail, so the force is unknown: controlled stop
  sensor_frozen,        // one reading for more than max_repeated_samples cycles: controlled stop
  force_not_finite,     // decoded force is NaN or infinite: controlled stop
  force_excessive,      // beyond the cell's max_force_N: controlled stop
  force_at_start,       // the handle was pushed while the sensor was tared: nothing is enabled
  drive_silent,         // no TPDO of a drive for more than max_missed_feedback cycles: controlled stop of the others
  drive_fault,          // a drive reports the state fault, or an EMCY: controlled stop of the others
  modbus_silent,        // no answer of a drive on a Modbus line for stale_after_s, or the line is closed: likewise
  drive_disabled,       // a drive left operation enabled by itself: controlled stop of the others
  drive_not_enabled,    // a drive didn't reach operation enabled in time: nothing moves
  drive_not_disabled,   // a drive didn't confirm within a second that it is switched off
  target_out_of_range,  // a setpoint would leave a joint's range or its counts: controlled stop
  target_too_fast,      // a setpoint would exceed a joint's speed: controlled stop
  singular,             // inverse kinematics found no bounded step: controlled stop
  leash_exceeded,       // the tool doesn't follow the proxy: controlled stop
  proxy_not_finite,     // the integrator refused a step: controlled stop
  proxy_squeezed,       // objects that move leave the proxy no room: controlled stop
  bus_off,              // a CAN controller is off the bus: nothing can be commanded, drives stop by themselves
  send_failed,          // a frame couldn't be queued (ENOBUFS): controlled stop
  receive_overflow,     // the kernel dropped frames: controlled stop
  overrun,              // more than max_overruns cycles in a row were late: controlled stop
  second_master,   // somebody else sends SYNC, NMT commands, setpoints or the controller's heartbeat: controlled stop
  error_passive,   // a CAN controller counts so many errors that it may only listen for them: controlled stop
  interface_down,  // a CAN interface is down or gone: controlled stop of the others, its own drives stop by themselves
};

// A fault, where it was seen, and when.
struct FaultReport {
  Fault fault = Fault::none;
  std::int32_t where = -1;  // drive index, bus index, or −1 for the sensor and the controller itself
  std::uint64_t cycle = 0;
  double value = 0.0;  // the figure that broke the limit, in the unit that describe() prints
  double limit = 0.0;
};

// The name of the enumerator: "sensor_lost".
const char* fault_name(Fault fault) noexcept;

// Cause, what the arm did, and what to do, in one line; `where` is the name of the drive, joint or bus. `drives_off`:
// every drive has confirmed that it is switched off.
std::string describe(const FaultReport& report, const std::string& where, bool drives_off = true);

}  // namespace proxarm::controller
