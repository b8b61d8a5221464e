#include "controller/fault.hpp"

#include <array>
#include <cstdio>

namespace proxarm::controller {
namespace {

constexpr const char* stopped = "the arm made a controlled stop and the drives were switched off";
constexpr const char* still = "the arm had not begun to move, and the drives were switched off";
constexpr const char* unconfirmed =
    "the arm was told to stop and to switch off, but not every drive has confirmed it: keep away until its power is "
    "off";

// One row per fault: what was seen (with one %s for where, %.4g value, %.4g limit used as the row says), what to do.
// Faults that only a start can have say that nothing has moved.
struct FaultText {
  Fault fault;
  const char* name;
  const char* cause;
  const char* unit;  // of value and limit; nullptr: no figures
  const char* advice;
  const char* did = stopped;
};

constexpr std::array texts{
    FaultText{Fault::none, "none", "no fault", nullptr, ""},
    FaultText{Fault::sensor_lost, "sensor_lost", "no complete sample of the force sensor in time", "cycles",
              "check the sensor's cable, power and identifiers; `proxarm plan` tells whether its bus can carry it"},
    FaultText{Fault::sensor_status, "sensor_status", "the force sensor's status word reports an error", nullptr,
              "power-cycle the sensor; look up the status bits in its manual"},
    FaultText{Fault::sensor_saturated, "sensor_saturated", "a gauge of the force sensor is at its rail", nullptr,
              "push less, or use a sensor with a larger range"},
    FaultText{Fault::sensor_frozen, "sensor_frozen", "the force sensor repeats one reading to the last digit",
              "samples", "power-cycle the sensor; if it is that quiet, set sensor.noise_N to 0 in the cell file"},
    FaultText{Fault::force_not_finite, "force_not_finite", "the decoded force isn't a finite number", nullptr,
              "check the sensor's calibration matrix"},
    FaultText{Fault::force_excessive, "force_excessive", "force beyond limits.max_force_N", "N",
              "push less, or raise the limit in the cell file"},
    FaultText{Fault::force_at_start, "force_at_start", "the handle was touched while the sensor was tared", "N",
              "take the hand off the handle until rendering starts", still},
    FaultText{Fault::drive_silent, "drive_silent", "no feedback from a drive", "cycles",
              "check the drive's power, cable and node number"},
    FaultText{Fault::drive_fault, "drive_fault", "a drive reports a fault", nullptr,
              "read the drive's error code in the record, mend its cause, start again"},
    FaultText{Fault::modbus_silent, "modbus_silent", "no complete answer on a Modbus line in time", nullptr,
              "check the drive's power, the line's cable or network, and the unit's number"},
    FaultText{Fault::drive_disabled, "drive_disabled", "a drive left operation enabled by itself", nullptr,
              "check the drive's enable input, its supply and STO"},
    FaultText{Fault::drive_not_enabled, "drive_not_enabled", "a drive didn't reach operation enabled", "s",
              "check the drive's power stage, STO and enable input", still},
    FaultText{Fault::drive_not_disabled, "drive_not_disabled", "a drive didn't confirm that it is switched off",
              nullptr, "switch the drives' power off; then check the drive's cable and supply"},
    FaultText{Fault::target_out_of_range, "target_out_of_range", "the motion would leave a joint's range", "rad",
              "keep away from that end of the range, or move the scene"},
    FaultText{Fault::target_too_fast, "target_too_fast", "the motion would exceed a joint's speed", "rad/s",
              "move slower, raise mass or damping, or move the scene away from the singularity"},
    FaultText{Fault::singular, "singular", "the arm is too close to a singularity to follow", nullptr,
              "move the scene or the start pose"},
    FaultText{Fault::leash_exceeded, "leash_exceeded", "the tool doesn't follow the proxy", "m",
              "look for an obstacle or a jammed joint; limits.leash_m holds the limit"},
    FaultText{Fault::proxy_not_finite, "proxy_not_finite", "the proxy's step isn't finite", nullptr,
              "check the scene with `proxarm check`"},
    FaultText{Fault::proxy_squeezed, "proxy_squeezed", "objects of the scene close on the proxy from both sides",
              nullptr, "change their motion so that they leave it room"},
    FaultText{Fault::bus_off, "bus_off", "the CAN controller went off the bus", nullptr,
              "check termination, bitrate and cable; an interface without restart-ms comes back by `ip link set IFACE "
              "type can restart`"},
    FaultText{Fault::send_failed, "send_failed", "a frame couldn't be sent: the interface's queue is full", nullptr,
              "check cable, termination and bitrate, for nobody acknowledges, or who else floods the bus"},
    FaultText{Fault::receive_overflow, "receive_overflow", "received frames were dropped by the kernel", "frames",
              "another program floods the bus, or the machine is too slow"},
    FaultText{Fault::overrun, "overrun", "cycles in a row ended too late", "cycles",
              "use a longer --timestep, or a faster or less loaded machine"},
    FaultText{Fault::second_master, "second_master", "another master commands this bus", nullptr,
              "end the other controller or configuration tool, or unplug it, before the next start"},
    FaultText{Fault::error_passive, "error_passive", "the CAN controller is error passive: 128 errors or more", nullptr,
              "check termination, bitrate and cable of this bus before it goes off altogether"},
    FaultText{Fault::interface_down, "interface_down", "the CAN interface is down or was removed", nullptr,
              "find out who took it down (`dmesg`, `ip link`) and check its plug, then set it up again"},
};

const FaultText& text_of(Fault fault) noexcept {
  for (const FaultText& text : texts) {
    if (text.fault == fault) return text;
  }
  return texts.front();
}

}  // namespace

const char* fault_name(Fault fault) noexcept { return text_of(fault).name; }

std::string describe(const FaultReport& report, const std::string& where, bool drives_off) {
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
  line +=
      " at cycle " + std::to_string(report.cycle) + "; " + (drives_off ? text.did : unconfirmed) + "; " + text.advice;
  return line;
}

}  // namespace proxarm::controller
