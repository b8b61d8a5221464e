// Lists all faults of a running session, the arm's reactions to them, and their descriptions for the user.
//
// Two things are no faults: set-up mistakes, which throw SetupError before anything moves, and active limits, which are
// recorded in separate flags. Each fault has one reaction (see the table in fault.cpp and
// docs/reference/supervision.md); if that table allows it, a cell may choose another reaction. A stop latches the
// fault, and the session ends with exit status 1 unless a person resets the fault.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "models/description/supervision.hpp"

namespace proxarm::controller {

enum class Fault : std::uint8_t {
  none,
  sensor_lost,           // no complete sample for more than max_missed_samples cycles
  sensor_late,           // samples are missing repeatedly, but in fewer successive cycles than for sensor_lost
  sensor_status,         // the sensor's status word reports an error
  sensor_saturated,      // a strain gauge is at its limit, so the force is unknown
  sensor_frozen,         // more than max_repeated_samples successive samples repeat one reading
  force_not_finite,      // the decoded force is NaN or infinite
  force_excessive,       // the force exceeds the cell's max_force_N
  force_reversed,        // the force grows with the motion that it causes: wrong sign, mounting or joint direction
  sensor_drifts,         // with nobody at the handle, the bias has drifted by more than max_bias_drift_N
  force_at_start,        // the handle was held or pushed during the tare: nothing moves
  feedback_late,         // a drive's TPDO is missing, for at most max_missed_feedback cycles
  drive_silent,          // a drive's TPDO is missing for more than max_missed_feedback cycles
  drive_fault,           // a drive reports the state fault, or an EMCY
  modbus_silent,         // a drive on a Modbus line hasn't answered for stale_after_s, or the line is closed
  drive_disabled,        // a drive left operation enabled by itself
  joint_out_of_range,    // a joint is out of its range at the start: nothing moves
  drive_not_enabled,     // a drive didn't reach operation enabled in time: nothing moves
  drive_not_disabled,    // a drive didn't confirm within a second that it is switched off
  timestep_unknown,      // a drive confirms neither the new timestep nor the old one
  position_implausible,  // an encoder jumped further than its joint can have moved
  drive_deviates,        // by its encoder, a drive moves without a setpoint
  drive_blocked,         // a drive doesn't reach its setpoint, which waits for the drive, and no hand holds the joint
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
  bus_off,               // a CAN controller is bus-off: nothing on its bus can be commanded
  send_failed,           // a frame couldn't be queued (ENOBUFS)
  receive_overflow,      // the kernel dropped frames
  overrun,               // more than max_overruns cycles in a row were late or skipped
  second_master,         // another node sends SYNC, NMT commands, setpoints or the controller's heartbeat
  error_passive,         // a CAN controller is error-passive: it has counted many errors
  interface_down,        // a CAN interface is down or removed: the drives on its bus stop by themselves
  enabling_released,     // the enabling input was released, or its messages stopped
  enabling_not_pressed,  // the enabling input wasn't released and pressed within enabling_timeout_s of the start:
                         // nothing moves
  enabling_squeezed,     // a three-position switch was squeezed through
  standstill_left,       // by its encoder, a joint moves while the arm should stand
  weight_unknown,        // holding a device takes another torque than its weight, or a gear's torque reading has the
                         // wrong sign: nothing moves
  force_jumped,          // the force changed within a sample by more than a hand on the handle can change it
};
inline constexpr std::size_t fault_count = static_cast<std::size_t>(Fault::force_jumped) + 1;

// The arm's reactions, in increasing strength.
enum class Reaction : std::uint8_t {
  carry_on,  // "continue": the fault is counted and shown
  slow,      // lowers the tool's speed limit to slow_speed_m_per_s until half a second after the fault
  hold,      // stop category 2: a controlled stop; the drives stay enabled, and rendering can continue
  stop_1,    // stop category 1: a controlled stop, then the drives are switched off
  stop_0,    // stop category 0: the drives are switched off at once
};

using Reactions = std::array<Reaction, fault_count>;

// A fault with place and cycle.
struct FaultReport {
  Fault fault = Fault::none;
  std::int32_t where = -1;  // drive index, bus index, or −1 for the sensor and the controller
  std::uint64_t cycle = 0;
  double value = 0.0;  // the value that exceeded the limit, in the unit that describe() prints
  double limit = 0.0;
  // The arm's reaction. `hold` in the report of a stop: the stop followed a hold that lasted too long.
  Reaction reaction = Reaction::stop_1;
  std::array<double, 3> force_W_N{};  // force_at_start: force on the handle without the tool's weight; 0: unknown
};

// Returns the enumerator's name: "sensor_lost".
const char* fault_name(Fault fault) noexcept;
// Returns the reaction's name in cell files and documentation: "continue", "slow", "hold", "stop_1", "stop_0".
const char* reaction_name(Reaction reaction) noexcept;
// Returns the reaction to a fault if the cell doesn't choose another one.
Reaction default_reaction(Fault fault) noexcept;
// Returns all reactions, with the cell's choices.
Reactions reactions_of(const description::SupervisionDescription& supervision);

// Describes a force on the handle at the start by size, direction in W, and possible causes: "25 N towards +x: is
// somebody holding it?". If the force points along gravity, a wrong mass of the tool is named as a possible cause.
// Returns an empty string if the force is unknown.
std::string standing_force_text(const FaultReport& report, const std::array<double, 3>& gravity_W_m_per_s2);

// Describes a fault in one line: the cause, the arm's reaction, and advice. `where`: name of the drive, joint or bus.
// `drives_off`: all drives have confirmed that they are switched off.
std::string describe(const FaultReport& report, const std::string& where, bool drives_off = true);
// Describes a fault whose stop was turned into stop category 0 by another fault, the escalation.
std::string describe(const FaultReport& report, const std::string& where, const FaultReport& escalation,
                     const std::string& where_then, bool drives_off);

}  // namespace proxarm::controller
