// A cell's keys for supervision, `supervision:` and `enabling_input:`, which load_cell() reads.
//
//   supervision:                       # all keys are optional
//     hold_s: 10                       # drives stay enabled for this long in a hold, then switch off
//     ramp_in_s: 0.2                   # the hand's force is let in over this time after the start and each hold
//     slow_speed_m_per_s: 0.1          # the tool's limit while a fault's reaction is slow
//     release_speed_m_per_s: 0.05      # the tool's limit while it follows a pinned hand or backs off
//     brake_release: "key switch S3"   # where the brakes can be opened by hand, for messages
//     let_go: rest                     # when nobody holds the handle: rest, coast or hold
//     empty_handle_N: 0.1              # below this force for half a second, nobody holds the handle
//     max_bias_drift_N: 0.5            # largest drift of the force sensor's bias meanwhile
//     max_force_step_N: 60             # largest change of force by hand and handle between two samples
//     reactions: {sensor_lost: hold}   # of faults that leave a choice: reaction_choices()
//
//     monitored_standstill: false      # a joint that moves while the arm must stand is a fault (standstill_left)
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

// A fault, by its name in the controller, and the reactions that a cell may choose for it.
struct ReactionChoice {
  const char* fault;
  std::vector<std::string> allowed;
};
[[nodiscard]] const std::vector<ReactionChoice>& reaction_choices();

// What the arm does when nobody holds the handle (controller/handle/empty_handle.hpp).
enum class LetGo : std::uint8_t {
  rest,   // comes to rest until a hand takes hold of it
  coast,  // the proxy keeps its speed
  hold,   // a hold, like the order
};

struct SupervisionDescription {
  double hold_s = 10.0;
  double ramp_in_s = 0.2;
  double slow_speed_m_per_s = 0.1;
  double release_speed_m_per_s = 0.05;
  LetGo let_go = LetGo::rest;
  double empty_handle_N = 0.1;     // below this for half a second nobody holds the handle
  double max_bias_drift_N = 0.5;   // largest drift of the sensor's bias while nobody holds the handle
  double max_force_step_N = 60.0;  // largest change of force by hand and handle between two samples
                                   // (controller/handle/force_jump.hpp)
  bool monitored_standstill = false;
  double bus_loss_stop_s = 0.06;  // time in which each drive on CAN stops by itself when the controller is gone
  std::string brake_release;      // how to open the brakes by hand; empty: not possible
  std::map<std::string, std::string> reactions;  // fault's name to one of its reaction_choices()

  bool operator==(const SupervisionDescription&) const = default;
};

// The contact that shows that an enabling switch with three positions is squeezed through; in the same object or
// message.
struct PanicContact {
  int byte = 0;             // of the message's data
  int bit = 0;              // of that byte; for a drive's object 0 to 31
  bool squeezed_is = true;  // the bit's value while the switch is squeezed through

  bool operator==(const PanicContact&) const = default;
};

// The bit that shows that the person presses the enabling switch; with three positions, that it is in the middle one.
struct EnablingInputDescription {
  std::string drive;                // joint of the drive whose digital input it is; empty: a CAN message
  std::uint32_t object = 0x60FD00;  // of that drive, index << 8 | sub-index, 32 bits, in TPDO2 at every SYNC
  std::string bus;                  // of the message, or of the drive
  std::uint32_t identifier = 0;     // of the message
  bool extended = false;            // the identifier has 29 bits
  int byte = 0;                     // of the message's data
  int bit = 0;                      // of that byte; for a drive's object 0 to 31
  bool pressed_is = true;           // the bit's value while the switch is pressed
  double timeout_s = 0.05;          // older messages count as released
  std::optional<PanicContact> three_position;

  bool operator==(const EnablingInputDescription&) const = default;
};

// `node` is the map under the key. The caller checks buses and drives.
SupervisionDescription read_supervision(const YamlNode& node);
EnablingInputDescription read_enabling_input(const YamlNode& node);

}  // namespace proxarm::description
