// Reads a cell's keys `supervision:` and `enabling_input:`. load_cell() calls the functions of this file.
//
//   supervision:                       # all keys are optional
//     hold_s: 10                       # longest time of a hold; then the drives switch off
//     ramp_in_s: 0.2                   # the hand's force is faded in over this time after the start and each hold
//     slow_speed_m_per_s: 0.1          # limit of the tool's speed during a fault whose reaction is slow
//     release_speed_m_per_s: 0.05      # limit of the tool's speed in a release and in a back-off
//     brake_release: "key switch S3"   # how a person can open the brakes by hand; used in messages
//     let_go: rest                     # what the arm does when nobody holds the handle: rest, coast or hold
//     empty_handle_N: 0.1              # if the force is below this for half a second, nobody holds the handle
//     max_bias_drift_N: 0.5            # largest drift of the force sensor's bias while nobody holds the handle
//     max_force_step_N: 60             # largest change of the force of hand and handle between two samples
//     reactions: {sensor_lost: hold}   # of faults for which a reaction can be chosen: reaction_choices()
//
//     monitored_standstill: false      # if true, motion of a joint while the arm must stand is a fault
//
//   enabling_input: {drive: axis_3, bit: 16}                                  # bit of 60FDh, the digital inputs
//   enabling_input: {bus: sensor, identifier: 0x1A0, byte: 0, bit: 0}         # bit of a CAN message
//   enabling_input: {drive: axis_3, bit: 16, three_position: {panic_bit: 17}}   # panic_bit: switch squeezed through
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

// A fault, by its name in the controller, and the reactions to it that a cell may choose.
struct ReactionChoice {
  const char* fault;
  std::vector<std::string> allowed;
};
[[nodiscard]] const std::vector<ReactionChoice>& reaction_choices();

// What the arm does while nobody holds the handle (controller/handle/empty_handle.hpp).
enum class LetGo : std::uint8_t {
  rest,   // the arm comes to rest until a hand takes the handle
  coast,  // the proxy keeps its speed
  hold,   // the arm goes into a hold, as after the order hold
};

struct SupervisionDescription {
  double hold_s = 10.0;
  double ramp_in_s = 0.2;
  double slow_speed_m_per_s = 0.1;
  double release_speed_m_per_s = 0.05;
  LetGo let_go = LetGo::rest;
  double empty_handle_N = 0.1;    // if the force is below this for half a second, nobody holds the handle
  double max_bias_drift_N = 0.5;  // largest drift of the sensor's bias while nobody holds the handle
  // Largest change of the force of hand and handle between two successive samples (controller/handle/force_jump.hpp).
  double max_force_step_N = 60.0;
  bool monitored_standstill = false;
  // Time in which each drive on CAN stops by itself when the controller is gone.
  double bus_loss_stop_s = 0.06;
  std::string brake_release;                     // how a person can open the brakes by hand; empty: not possible
  std::map<std::string, std::string> reactions;  // key: a fault's name; value: one of the fault's reaction_choices()

  bool operator==(const SupervisionDescription&) const = default;
};

// The contact that shows that an enabling switch with three positions is squeezed through. It is in the same object or
// message as the contact of the middle position.
struct PanicContact {
  int byte = 0;             // in the data of the message
  int bit = 0;              // in this byte, or 0 to 31 in a drive's object
  bool squeezed_is = true;  // the bit's value while the switch is squeezed through

  bool operator==(const PanicContact&) const = default;
};

// The bit that shows that the person presses the enabling switch. For a switch with three positions, it shows the
// middle position.
struct EnablingInputDescription {
  std::string drive;  // joint of the drive that has the digital input; empty: a CAN message
  // The object of this drive with the input, as index << 8 | sub-index. It has 32 bits and is sent in TPDO2 at every
  // SYNC.
  std::uint32_t object = 0x60FD00;
  std::string bus;               // bus of the message or of the drive
  std::uint32_t identifier = 0;  // identifier of the message
  bool extended = false;         // whether the identifier has 29 bits
  int byte = 0;                  // in the data of the message
  int bit = 0;                   // in this byte, or 0 to 31 in a drive's object
  bool pressed_is = true;        // the bit's value while the switch is pressed
  double timeout_s = 0.05;       // if the last message is older than this, the switch counts as released
  std::optional<PanicContact> three_position;

  bool operator==(const EnablingInputDescription&) const = default;
};

// Reads the map under the key `supervision` or `enabling_input`. The caller checks that the named buses and drives
// exist.
SupervisionDescription read_supervision(const YamlNode& node);
EnablingInputDescription read_enabling_input(const YamlNode& node);

}  // namespace proxarm::description
