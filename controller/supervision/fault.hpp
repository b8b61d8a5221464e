// What can go wrong while a session runs, how the arm reacts, and what the user is told of it.
//
// Set-up mistakes throw SetupError before anything moves; an active limit is no fault and has flags of its own. Each
// fault has one reaction (a row of the table in fault.cpp, docs/supervision.md shows it); a cell may choose another one
// where the row allows it. A stop latches the fault, and the run ends with exit status 1 unless it is reset.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "models/description/supervision.hpp"

namespace proxarm::controller {

enum class Fault : std::uint8_t {
  none,
  sensor_lost,           // no complete sample for more than max_missed_samples cycles
  sensor_late,           // samples are missing again and again, but never so many in a row
  sensor_status,         // the sensor's status word reports an error
  sensor_saturated,      // a strain gauge is at its limit, so the force is unknown
  sensor_frozen,         // the same reading for more than max_repeated_samples samples
  force_not_finite,      // decoded force is NaN or infinite
  force_excessive,       // beyond the cell's max_force_N
  force_reversed,        // the force grows with the motion that it causes: wrong sign, mounting or joint direction
  sensor_drifts,         // with nobody at the handle, the bias has drifted further than max_bias_drift_N
  force_at_start,        // the handle was held or pushed while the sensor was tared: nothing moves
  feedback_late,         // a drive's TPDO missing, for no more than max_missed_feedback cycles
  drive_silent,          // no TPDO of a drive for more than max_missed_feedback cycles
  drive_fault,           // a drive reports the state fault, or an EMCY
  modbus_silent,         // no answer of a drive on a Modbus line for stale_after_s, or the line is closed
  drive_disabled,        // a drive left operation enabled by itself
  joint_out_of_range,    // a joint stands out of its range at the start: nothing moves
  drive_not_enabled,     // a drive didn't reach operation enabled in time: nothing moves
  drive_not_disabled,    // a drive didn't confirm within a second that it is switched off
  timestep_unknown,      // a drive confirms neither the timestep that it was to take nor the one before
  position_implausible,  // an encoder has jumped further than its joint can have moved
  drive_deviates,        // by its encoder, a drive moves where no setpoint sent it
  drive_blocked,         // a drive doesn't reach its setpoint, which waits for it, and no hand holds it
  target_out_of_range,   // a setpoint would leave a joint's range or its counts
  target_too_fast,       // a setpoint would exceed a joint's speed
  singular,              // inverse kinematics found no bounded step
  leash_exceeded,        // the tool doesn't follow the proxy
  tool_too_fast,         // by the encoders the tool exceeds its speed limit, though no setpoint does
  tool_off_limits,       // by the encoders the tool is out of the workspace or in a keep-out zone; no setpoint is
  elbow_too_fast,        // by the encoders the elbow or the wrist is faster than its limit, though no setpoint is
  works_against_hand,    // limits push the tool against the hand for longer than the arm brakes
  proxy_not_finite,      // the integrator refused a step
  proxy_squeezed,        // objects that move leave the proxy no room
  bus_off,               // a CAN controller is bus-off: nothing can be commanded there
  send_failed,           // a frame couldn't be queued (ENOBUFS)
  receive_overflow,      // the kernel dropped frames
  overrun,               // more than max_overruns cycles in a row were late or left out
  second_master,         // somebody else sends SYNC, NMT commands, setpoints or the controller's heartbeat
  error_passive,         // a CAN controller is error-passive: it has counted many errors
  interface_down,        // a CAN interface is down or gone: its drives stop by themselves
  enabling_released,     // the enabling input was released, or its messages have stopped
  enabling_not_pressed,  // it wasn't released and pressed within enabling_timeout_s of the start: nothing moves
  enabling_squeezed,     // a switch with three positions was squeezed through
  standstill_left,       // a joint moves, by its encoder, where the arm is to stand
  weight_unknown,  // to hold a device takes another torque than its weight, or a gear's reads reversed: nothing moves
  force_jumped,    // the force has changed within a sample by more than hand and handle can make
};
inline constexpr std::size_t fault_count = static_cast<std::size_t>(Fault::force_jumped) + 1;

// What the arm does. Each reaction does more than the one before.
enum class Reaction : std::uint8_t {
  carry_on,  // "continue": counted and shown
  slow,      // the tool's speed limit goes down to slow_speed_m_per_s until half a second after the fault has gone
  hold,      // stop category 2: a controlled stop; the drives stay enabled, and rendering can go on
  stop_1,    // stop category 1: a controlled stop, then the drives are switched off
  stop_0,    // stop category 0: the drives are switched off at once
};

// The reaction to each fault, indexed by the fault.
using Reactions = std::array<Reaction, fault_count>;

// A fault, and where and when it was seen.
struct FaultReport {
  Fault fault = Fault::none;
  std::int32_t where = -1;  // drive index, bus index, or −1 for the sensor and the controller itself
  std::uint64_t cycle = 0;
  double value = 0.0;  // the figure that broke the limit, in the unit that describe() prints
  double limit = 0.0;
  Reaction reaction = Reaction::stop_1;  // what the arm did; hold: a hold that lasted too long led to the stop
  std::array<double, 3> force_W_N{};     // force_at_start: what stands on the handle beyond the tool's weight; 0: not
                                         // known
};

// The name of the enumerator: "sensor_lost".
const char* fault_name(Fault fault) noexcept;
// The reaction's name in cell files and documentation: "continue", "slow", "hold", "stop_1", "stop_0".
const char* reaction_name(Reaction reaction) noexcept;
// The reaction if the cell chooses none.
Reaction default_reaction(Fault fault) noexcept;
// All reactions, with the cell's choices.
Reactions reactions_of(const description::SupervisionDescription& supervision);

// What of a force that stands on the handle at the start, in words with its direction in W and what it may be: "25 N
// towards +x: is somebody holding it?". Along gravity it may be the tool's mass, too. Empty: it isn't known.
std::string standing_force_text(const FaultReport& report, const std::array<double, 3>& gravity_W_m_per_s2);

// Describes the cause, what the arm did, and what to do, in one line. `where`: the name of the drive, joint or bus.
// `drives_off`: every drive has confirmed that it is switched off.
std::string describe(const FaultReport& report, const std::string& where, bool drives_off = true);
// The same where another fault made a stop of category 0 of the stop that was under way.
std::string describe(const FaultReport& report, const std::string& where, const FaultReport& escalation,
                     const std::string& where_then, bool drives_off);

}  // namespace proxarm::controller
