#include "controller/supervision/fault.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace proxarm::controller {
namespace {

constexpr const char* stopped = "the arm made a controlled stop and the drives were switched off";
constexpr const char* at_once = "the drives were switched off at once; the brakes are to stop the arm";
constexpr const char* held =
    "the arm made a controlled stop, was held there for supervision.hold_s, and the drives were switched off";
constexpr const char* still = "the arm had not begun to move, and the drives were switched off";
constexpr const char* unconfirmed =
    "the arm was told to stop and to switch off, but not every drive has confirmed it: keep away until its power is "
    "off";

// One row for each fault: reaction, cause and advice. A fault that occurs only at a start also has `did`, which says
// that nothing has moved.
struct FaultText {
  Fault fault;
  const char* name;
  Reaction reaction;  // the reaction if the cell doesn't choose another one (description::reaction_choices())
  const char* cause;
  const char* unit;  // unit of value and limit; nullptr: value and limit aren't printed
  const char* advice;
  const char* did = nullptr;  // what the arm did; nullptr: the text for the reaction
};

constexpr std::array texts{
    FaultText{Fault::none, "none", Reaction::stop_1, "no fault", nullptr, ""},
    FaultText{Fault::sensor_lost, "sensor_lost", Reaction::stop_1, "no complete sample of the force sensor in time",
              "cycles",
              "check the sensor's cable, power and identifiers; `proxarm plan` tells whether its bus can carry it"},
    FaultText{Fault::sensor_late, "sensor_late", Reaction::slow,
              "samples of the force sensor are missing again and again", "of them lately",
              "check the sensor's cable and the load of its bus: `proxarm plan`"},
    FaultText{Fault::sensor_status, "sensor_status", Reaction::stop_1,
              "the force sensor's status word reports an error", nullptr,
              "power-cycle the sensor; look up the status bits in its manual"},
    FaultText{Fault::sensor_saturated, "sensor_saturated", Reaction::stop_1,
              "a gauge of the force sensor is at its rail", nullptr, "push less, or use a sensor with a larger range"},
    FaultText{Fault::sensor_frozen, "sensor_frozen", Reaction::stop_1,
              "the force sensor, or a channel of it, repeats one reading to the last digit", "samples",
              "power-cycle the sensor; of a simulated one without noise, sensor.noise_N is 0 in the cell file"},
    FaultText{Fault::force_not_finite, "force_not_finite", Reaction::stop_1, "the decoded force isn't a finite number",
              nullptr, "check the sensor's calibration matrix"},
    FaultText{Fault::force_excessive, "force_excessive", Reaction::stop_1, "force beyond limits.max_force_N", "N",
              "push less, or raise the limit in the cell file"},
    FaultText{Fault::sensor_drifts, "sensor_drifts", Reaction::stop_1,
              "the force sensor's bias has drifted while nobody held the handle", "N",
              "start anew, which tares the sensor; if it comes again, let the sensor warm up, or look for damage and "
              "for something that leans on the handle"},
    FaultText{Fault::force_reversed, "force_reversed", Reaction::stop_1,
              "the hand's force grows with the motion that it causes, as if the arm went the other way", "N",
              "check the sensor's sign and how it is mounted (sensor.pose_link), and each drive's direction"},
    FaultText{Fault::force_at_start, "force_at_start", Reaction::stop_1,
              "the handle was touched while the sensor was tared", "N",
              "take the hand off the handle until rendering starts; with nobody there, `proxarm zero CELL` takes what "
              "the sensor reads for its zero, and --accept-force starts all the same",
              still},
    FaultText{Fault::feedback_late, "feedback_late", Reaction::carry_on, "a drive's feedback was missing", "cycles",
              "check the drive's cable and the load of its bus: `proxarm plan`"},
    FaultText{Fault::drive_silent, "drive_silent", Reaction::stop_1, "no feedback from a drive", "cycles",
              "check the drive's power, cable and node number"},
    FaultText{Fault::drive_fault, "drive_fault", Reaction::stop_1, "a drive reports a fault", nullptr,
              "read the drive's error code in the record, mend its cause, start again"},
    FaultText{Fault::modbus_silent, "modbus_silent", Reaction::stop_1, "no complete answer on a Modbus line in time",
              nullptr, "check the drive's power, the line's cable or network, and the unit's number"},
    FaultText{Fault::drive_disabled, "drive_disabled", Reaction::stop_1, "a drive left operation enabled by itself",
              nullptr, "check the drive's enable input, its supply and STO"},
    FaultText{
        Fault::joint_out_of_range, "joint_out_of_range", Reaction::stop_1,
        "a joint stands out of its range_rad, by its encoder", "rad",
        "are nodes swapped, or is offset_counts, direction or gear_ratio wrong? If the joint is where the encoder "
        "says, bring it back by the drive's own tool",
        still},
    FaultText{Fault::drive_not_enabled, "drive_not_enabled", Reaction::stop_1, "a drive didn't reach operation enabled",
              "s", "check the drive's power stage, STO and enable input", still},
    FaultText{Fault::drive_not_disabled, "drive_not_disabled", Reaction::stop_0,
              "a drive didn't confirm that it is switched off", nullptr,
              "switch the drives' power off; then check the drive's cable and supply"},
    FaultText{Fault::timestep_unknown, "timestep_unknown", Reaction::stop_1,
              "a drive confirms neither the new timestep nor the one before (60C2h)", nullptr,
              "check the drive's cable, then start anew: that configures it; a reset doesn't"},
    FaultText{Fault::position_implausible, "position_implausible", Reaction::stop_0,
              "an encoder jumped further than its joint can move", "rad in a cycle",
              "check the encoder, its cable and the drive before anybody comes near"},
    FaultText{Fault::drive_deviates, "drive_deviates", Reaction::stop_0,
              "a drive goes where no setpoint sent it, by its encoder", "rad away",
              "look for a drive that runs off, turns the wrong way or is too weak for the arm's weight, and for an "
              "encoder that is off, before anybody comes near"},
    FaultText{Fault::drive_blocked, "drive_blocked", Reaction::hold, "a drive doesn't come to its setpoint",
              "rad behind",
              "look for an obstacle, a jammed joint or a closed brake; `proxarm back-off` gets somebody free, `proxarm "
              "resume` goes on"},
    FaultText{Fault::target_out_of_range, "target_out_of_range", Reaction::stop_1,
              "the motion would leave a joint's range", "rad",
              "keep away from that end of the range, or move the scene"},
    FaultText{Fault::target_too_fast, "target_too_fast", Reaction::stop_1, "the motion would exceed a joint's speed",
              "rad/s", "move slower, raise mass or damping, or move the scene away from the singularity"},
    FaultText{Fault::singular, "singular", Reaction::stop_1, "the arm is too close to a singularity to follow", nullptr,
              "move the scene or the start pose"},
    FaultText{Fault::leash_exceeded, "leash_exceeded", Reaction::stop_1, "the tool doesn't follow the proxy", "m",
              "look for an obstacle or a jammed joint; limits.leash_m holds the limit"},
    FaultText{
        Fault::tool_too_fast, "tool_too_fast", Reaction::stop_0,
        "the tool is faster than it was told to be, by the encoders", "m/s",
        "look for a drive that runs off, a slipping brake, a wrong gear ratio or encoder before anybody comes near"},
    FaultText{Fault::tool_off_limits, "tool_off_limits", Reaction::stop_1,
              "the tool has left its workspace, or is in a keep-out zone, by the encoders", "mm",
              "look for a drive that doesn't follow, or creeps; no setpoint was there"},
    FaultText{Fault::works_against_hand, "works_against_hand", Reaction::stop_1,
              "the arm's limits push the tool against the hand", "J",
              "keep away from there, and report it: limits may only hold the tool back"},
    FaultText{Fault::proxy_not_finite, "proxy_not_finite", Reaction::stop_1, "the proxy's step isn't finite", nullptr,
              "check the scene with `proxarm check`"},
    FaultText{Fault::proxy_squeezed, "proxy_squeezed", Reaction::stop_1,
              "objects of the scene close on the proxy from both sides", nullptr,
              "change their motion so that they leave it room"},
    FaultText{Fault::bus_off, "bus_off", Reaction::stop_1, "the CAN controller went off the bus", nullptr,
              "check termination, bitrate and cable; an interface without restart-ms comes back by `ip link set IFACE "
              "type can restart`"},
    FaultText{Fault::send_failed, "send_failed", Reaction::stop_1,
              "a frame couldn't be sent: the interface's queue is full", nullptr,
              "check cable, termination and bitrate, for nobody acknowledges, or who else floods the bus"},
    FaultText{Fault::receive_overflow, "receive_overflow", Reaction::stop_1,
              "received frames were dropped by the kernel", "frames",
              "another program floods the bus, or the machine is too slow"},
    FaultText{Fault::overrun, "overrun", Reaction::stop_1, "cycles in a row were late or left out", "cycles",
              "was the process suspended? Else use a longer --timestep, or a faster or less loaded machine"},
    FaultText{Fault::second_master, "second_master", Reaction::stop_1, "another master commands this bus", nullptr,
              "end the other controller or configuration tool, or unplug it, before the next start"},
    FaultText{Fault::error_passive, "error_passive", Reaction::slow,
              "the CAN controller is error passive: 128 errors or more", nullptr,
              "check termination, bitrate and cable of this bus before it goes off altogether"},
    FaultText{Fault::interface_down, "interface_down", Reaction::stop_1, "the CAN interface is down or was removed",
              nullptr, "find out who took it down (`dmesg`, `ip link`) and check its plug, then set it up again"},
    FaultText{Fault::enabling_released, "enabling_released", Reaction::hold, "the enabling input isn't pressed",
              nullptr, "press it to go on; if it is pressed, check its wiring and its message"},
    FaultText{Fault::enabling_not_pressed, "enabling_not_pressed", Reaction::stop_1,
              "the enabling input wasn't pressed in time", nullptr,
              "let go of it and press it: one that is pressed already could be tied down", still},
    FaultText{Fault::enabling_squeezed, "enabling_squeezed", Reaction::stop_1,
              "the enabling switch was squeezed through", nullptr,
              "see to whoever holds it first; then let go of it and press it to its middle position"},
    FaultText{Fault::standstill_left, "standstill_left", Reaction::stop_0,
              "a joint moved while the arm was to stand, by its encoder", "rad away",
              "look for a drive that runs off, an encoder that is off, or a load that the drive can't hold, before "
              "anybody comes near"},
    FaultText{Fault::weight_unknown, "weight_unknown", Reaction::stop_1,
              "to hold the arm still, this joint has a torque beside what the weight of its model asks for", "Nm",
              "are the masses of the URDF or of `tool` wrong, does somebody lean on the arm, or is more mounted on "
              "it? Correct them; what is left over would move a device with nobody there. Where `gear_torque` is "
              "measured: has its scale the wrong sign?",
              still},
    FaultText{Fault::force_jumped, "force_jumped", Reaction::stop_1,
              "the force has changed within a sample by more than hand and handle can make", "N",
              "look for a loose plug or cable of the sensor, and for another program that sets its zero or its axes; "
              "supervision.max_force_step_N holds the limit"},
    FaultText{
        Fault::elbow_too_fast, "elbow_too_fast", Reaction::stop_0,
        "the elbow or the wrist is faster than it was told to be, by the encoders", "m/s",
        "look for a drive that runs off, a slipping brake, a wrong gear ratio or encoder before anybody comes near"},
};

const FaultText& text_of(Fault fault) noexcept {
  for (const FaultText& text : texts) {
    if (text.fault == fault) return text;
  }
  return texts.front();
}

const char* did(const FaultText& text, Reaction reaction) noexcept {
  if (text.did != nullptr) return text.did;
  return reaction == Reaction::stop_0 ? at_once : reaction == Reaction::hold ? held : stopped;
}

// Returns the fault's name, place, cause and cycle.
std::string seen(const FaultReport& report, const std::string& where) {
  const FaultText& text = text_of(report.fault);
  std::string line = text.name;
  if (!where.empty()) line += " (" + where + ")";
  line += ": ";
  line += text.cause;
  if (text.unit != nullptr) {
    std::array<char, 96> figures{};
    std::snprintf(figures.data(), figures.size(), " (%.4g %s, limit %.4g)", report.value, text.unit, report.limit);
    line += figures.data();
  }
  return line + " at cycle " + std::to_string(report.cycle);
}

// A vector counts as pointing along an axis if its component along this axis is at least this share of its length, that
// is within 26 degrees.
constexpr double mostly = 0.9;

// Returns the number with two digits; from 10 on as a whole number.
std::string two_digits(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), number < 10.0 ? "%.2g" : "%.0f", number);
  return text.data();
}

// Returns the axis along which v points, such as "+x", or the unit vector if v points along no axis.
std::string direction_text(const std::array<double, 3>& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (std::abs(v[i]) >= mostly * length) return std::string(v[i] > 0.0 ? "+" : "-") + "xyz"[i];
  }
  return "(" + two_digits(v[0] / length) + ", " + two_digits(v[1] / length) + ", " + two_digits(v[2] / length) + ")";
}

constexpr std::array reaction_names{"continue", "slow", "hold", "stop_1", "stop_0"};

}  // namespace

const char* fault_name(Fault fault) noexcept { return text_of(fault).name; }

const char* reaction_name(Reaction reaction) noexcept { return reaction_names[static_cast<std::size_t>(reaction)]; }

Reaction default_reaction(Fault fault) noexcept { return text_of(fault).reaction; }

Reactions reactions_of(const description::SupervisionDescription& supervision) {
  Reactions reactions{};
  for (std::size_t i = 0; i < fault_count; ++i) {
    const auto fault = static_cast<Fault>(i);
    reactions[i] = default_reaction(fault);
    const auto chosen = supervision.reactions.find(fault_name(fault));
    if (chosen == supervision.reactions.end()) continue;
    const auto found = std::find(reaction_names.begin(), reaction_names.end(), chosen->second);
    if (found != reaction_names.end()) reactions[i] = static_cast<Reaction>(found - reaction_names.begin());
  }
  return reactions;
}

std::string standing_force_text(const FaultReport& report, const std::array<double, 3>& gravity_W_m_per_s2) {
  const auto& f = report.force_W_N;
  const double force_N = std::hypot(f[0], f[1], f[2]);
  if (!(force_N > 0.0)) return "";
  const auto& g = gravity_W_m_per_s2;
  const double gravity = std::hypot(g[0], g[1], g[2]);
  const double along = gravity > 0.0 ? (f[0] * g[0] + f[1] * g[1] + f[2] * g[2]) / gravity : 0.0;
  const std::string what = two_digits(force_N) + " N towards " + direction_text(f) + " of W: is somebody holding it, ";
  if (std::abs(along) < mostly * force_N) return what + "or has the sensor's zero moved?";
  return what + "or is the tool " + (along > 0.0 ? "heavier" : "lighter") + " by " +
         two_digits(std::abs(along) / gravity) + " kg?";
}

std::string describe(const FaultReport& report, const std::string& where, bool drives_off) {
  const FaultText& text = text_of(report.fault);
  return seen(report, where) + "; " + (drives_off ? did(text, report.reaction) : unconfirmed) + "; " + text.advice;
}

std::string describe(const FaultReport& report, const std::string& where, const FaultReport& escalation,
                     const std::string& where_then, bool drives_off) {
  return seen(report, where) + "; the arm began to stop, and then " + seen(escalation, where_then) + "; " +
         (drives_off ? at_once : unconfirmed) + "; " + text_of(escalation.fault).advice + "; " +
         text_of(report.fault).advice;
}

}  // namespace proxarm::controller
