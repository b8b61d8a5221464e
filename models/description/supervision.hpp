// What a cell says of its supervision: `supervision:` and `enabling_input:`. Read by load_cell().
//
//   supervision:                       # all of it may be left out
//     hold_s: 10                       # how long the drives stay enabled in a hold before they are switched off
//     ramp_in_s: 0.2                   # over which the hand's force is let in after the start and after each hold
//     slow_speed_m_per_s: 0.1          # of the tool, where the reaction to a fault is slow
//     release_speed_m_per_s: 0.05      # of the tool that follows a pinned hand, and of backing off
//     brake_release: "key switch S3"   # where the brakes can be opened by hand, for the messages
//     let_go: rest                     # what the arm does when nobody holds the handle: rest, coast or hold
//     empty_handle_N: 0.1              # below this force for half a second nobody holds it
//     max_bias_drift_N: 0.5            # by which the force sensor's bias may go meanwhile
//     max_force_step_N: 60             # by which hand and handle may change the force from one sample to the next
//     reactions: {sensor_lost: hold}   # of faults that leave a choice: reaction_choices()
//
//     monitored_standstill: false      # where the arm is to stand, a joint that moves is a fault (standstill_left)
//
//   enabling_input: {drive: axis_3, bit: 16}                                  # of 60FDh, the drive's digital inputs
//   enabling_input: {bus: sensor, identifier: 0x1A0, byte: 0, bit: 0}         # of a CAN message
//   enabling_input: {drive: axis_3, bit: 16, three_position: {panic_bit: 17}}   # squeezed through: a stop
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

// A fault (its name, as the controller has it) that leaves a choice, and what may be chosen.
struct ReactionChoice {
  const char* fault;
  std::vector<std::string> allowed;
};
[[nodiscard]] const std::vector<ReactionChoice>& reaction_choices();

// What the arm does when nobody holds the handle (controller/handle/empty_handle.hpp).
enum class LetGo : std::uint8_t {
  rest,   // it comes to rest and stays, until somebody takes hold of it
  coast,  // the proxy keeps its speed
  hold,   // a hold, as by order
};

struct SupervisionDescription {
  double hold_s = 10.0;
  double ramp_in_s = 0.2;
  double slow_speed_m_per_s = 0.1;
  double release_speed_m_per_s = 0.05;
  LetGo let_go = LetGo::rest;
  double empty_handle_N = 0.1;     // below this for half a second nobody is there
  double max_bias_drift_N = 0.5;   // by which the sensor's bias may go while nobody is there
  double max_force_step_N = 60.0;  // within a sample, by hand and handle (controller/handle/force_jump.hpp)
  bool monitored_standstill = false;
  double bus_loss_stop_s = 0.06;  // within which each drive on CAN stops by itself when the controller is gone
  std::string brake_release;      // how a person opens the brakes by hand; empty: not at all
  std::map<std::string, std::string> reactions;  // by the fault's name; a choice of reaction_choices()

  bool operator==(const SupervisionDescription&) const = default;
};

// The second contact of an enabling switch with three positions, in the same object or message: it says that the switch
// is squeezed through.
struct PanicContact {
  int byte = 0;             // of the message's data
  int bit = 0;              // of that byte; of a drive's object, 0 to 31
  bool squeezed_is = true;  // what the bit is while the switch is squeezed through

  bool operator==(const PanicContact&) const = default;
};

// One bit that says that the person's enabling switch is pressed; with three positions, that it is in the middle one.
struct EnablingInputDescription {
  std::string drive;                // joint of the drive that has it among its digital inputs; empty: a CAN message
  std::uint32_t object = 0x60FD00;  // of that drive, index << 8 | sub-index, 32 bits, in TPDO2 at every SYNC
  std::string bus;                  // of the message, or of the drive
  std::uint32_t identifier = 0;     // of the message
  bool extended = false;            // the identifier has 29 bits
  int byte = 0;                     // of the message's data
  int bit = 0;                      // of that byte; with `drive` of the object, 0 to 31
  bool pressed_is = true;           // what the bit is while the switch is pressed
  double timeout_s = 0.05;          // a message that is older says nothing: released
  std::optional<PanicContact> three_position;

  bool operator==(const EnablingInputDescription&) const = default;
};

// `node` is the map under the key. Buses and drives are for the caller to check.
SupervisionDescription read_supervision(const YamlNode& node);
EnablingInputDescription read_enabling_input(const YamlNode& node);

}  // namespace proxarm::description
