// Lists all faults of a running session, the arm's reactions to them, and their descriptions for the user.
//
// Set-up mistakes throw SetupError before anything moves; an active limit isn't a fault and has its own flags. Each
// fault has one reaction (see the table in fault.cpp and docs/supervision.md); if that table allows, a cell may choose
// another. A stop latches the fault, and the run ends with exit status 1 unless it is reset.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "models/description/supervision.hpp"

namespace proxarm::controller {

enum class Fault : std::uint8_t {
  none,
  sensor_lost,           // no complete sample for more than max_missed_samples cycles
  sensor_late,           // samples are missing repeatedly, but fewer in a row
  sensor_status,         // the sensor's status word reports an error
  sensor_saturated,      // a strain gauge is at its limit, so the force is unknown
  sensor_frozen,         // the same reading for more than max_repeated_samples samples
  force_not_finite,      // decoded force is NaN or infinite
  force_excessive,       // beyond the cell's max_force_N
  force_reversed,        // the force grows with the motion that it causes: wrong sign, mounting or joint direction
  sensor_drifts,         // with nobody at the handle, the bias has drifted by more than max_bias_drift_N
  force_at_start,        // the handle was held or pushed during the tare: nothing moves
  feedback_late,         // a drive's TPDO is missing, for at most max_missed_feedback cycles
  drive_silent,          // no TPDO of a drive for more than max_missed_feedback cycles
  drive_fault,           // a drive reports the state fault, or an EMCY
  modbus_silent,         // no answer of a drive on a Modbus line for stale_after_s, or the line is closed
  drive_disabled,        // a drive left operation enabled by itself
  joint_out_of_range,    // a joint is out of its range at the start: nothing moves
  drive_not_enabled,     // a drive didn't reach operation enabled in time: nothing moves
  drive_not_disabled,    // a drive didn't confirm within a second that it is switched off
  timestep_unknown,      // a drive confirms neither the new timestep nor the one before
  position_implausible,  // an encoder jumped further than its joint can have moved
  drive_deviates,        // by its encoder, a drive moves without a setpoint
  drive_blocked,         // a drive doesn't reach its setpoint, which waits for it, and no hand holds it
  target_out_of_range,   // a setpoint would leave a joint's range or its counts
  target_too_fast,       // a setpoint would exceed a joint's speed
  singular,              // inverse kinematics found no bounded step
  leash_exceeded,        // the tool doesn't follow the proxy
  tool_too_fast,         // by the encoders the tool exceeds its speed limit, though no setpoint does
  tool_off_limits,       // by the encoders the tool is out of the workspace or in a keep-out box, though no setpoint is
  elbow_too_fast,        // by the encoders elbow or wrist exceed their speed limit, though no setpoint does
  works_against_hand,    // limits push the tool against the hand for longer than the arm brakes
  proxy_not_finite,      // the integrator refused a step
  proxy_squeezed,        // moving objects leave the proxy no room
  bus_off,               // a CAN controller is bus-off: nothing can be commanded there
  send_failed,           // a frame couldn't be queued (ENOBUFS)
  receive_overflow,      // the kernel dropped frames
  overrun,               // more than max_overruns cycles in a row were late or skipped
  second_master,         // another node sends SYNC, NMT commands, setpoints or the controller's heartbeat
  error_passive,         // a CAN controller is error-passive: it has counted many errors
  interface_down,        // a CAN interface is down or removed: its drives stop by themselves
  enabling_released,     // the enabling input was released, or its messages stopped
  enabling_not_pressed,  // not released and pressed within enabling_timeout_s of the start: nothing moves
  enabling_squeezed,     // a three-position switch was squeezed through
  standstill_left,       // by its encoder, a joint moves while the arm should stand
  weight_unknown,  // holding a device takes another torque than its weight, or a gear's torque reads reversed: nothing
                   // moves
  force_jumped,    // the force changed within a sample by more than a hand on the handle can make
};
inline constexpr std::size_t fault_count = static_cast<std::size_t>(Fault::force_jumped) + 1;

// The arm's reactions, in increasing strength.
enum class Reaction : std::uint8_t {
  carry_on,  // "continue": counted and shown
  slow,      // lowers the tool's speed limit to slow_speed_m_per_s until half a second after the fault
  hold,      // stop category 2: a controlled stop; the drives stay enabled, and rendering can continue
  stop_1,    // stop category 1: a controlled stop, then the drives are switched off
  stop_0,    // stop category 0: the drives are switched off at once
};

using Reactions = std::array<Reaction, fault_count>;

// A fault, with its place and cycle.
struct FaultReport {
  Fault fault = Fault::none;
  std::int32_t where = -1;  // drive index, bus index, or −1 for the sensor and the controller itself
  std::uint64_t cycle = 0;
  double value = 0.0;  // the value that broke the limit, in the unit that describe() prints
  double limit = 0.0;
  Reaction reaction = Reaction::stop_1;  // the arm's reaction; hold: a hold that lasted too long became a stop
  std::array<double, 3> force_W_N{};     // force_at_start: force on the handle beyond the tool's weight; 0: unknown
};

// The enumerator's name: "sensor_lost".
const char* fault_name(Fault fault) noexcept;
// The reaction's name in cell files and documentation: "continue", "slow", "hold", "stop_1", "stop_0".
const char* reaction_name(Reaction reaction) noexcept;
// The reaction unless the cell chooses another.
Reaction default_reaction(Fault fault) noexcept;
// All reactions, with the cell's choices.
Reactions reactions_of(const description::SupervisionDescription& supervision);

// Describes a force on the handle at the start: size, direction in W, and possible causes: "25 N towards +x: is
// somebody holding it?". Along gravity, the tool's mass may also be the cause. Empty: the force is unknown.
std::string standing_force_text(const FaultReport& report, const std::array<double, 3>& gravity_W_m_per_s2);

// Describes in one line the cause, what the arm did, and what to do. `where`: name of the drive, joint or bus.
// `drives_off`: all drives have confirmed that they are switched off.
std::string describe(const FaultReport& report, const std::string& where, bool drives_off = true);
// The same if another fault turned the stop in progress into one of category 0.
std::string describe(const FaultReport& report, const std::string& where, const FaultReport& escalation,
                     const std::string& where_then, bool drives_off);

}  // namespace proxarm::controller
