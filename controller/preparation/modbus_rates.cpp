#include "controller/preparation/modbus_rates.hpp"

#include <algorithm>
#include <cstdio>

#include "fieldbus/modbus/modbus_client.hpp"
#include "fieldbus/modbus/modbus_drive.hpp"
#include "fieldbus/modbus/modbus_line.hpp"
#include "fieldbus/udp/udp_port.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/modbus_drive.hpp"

namespace proxarm::controller {
namespace {

// Delay of a setpoint on Modbus, in exchanges. A setpoint waits half an exchange on average for the next exchange, and
// is reached one exchange later.
constexpr double exchanges_late = 1.5;

void warn_if_unstable(const PreparedSession& session, const std::string& joint, double rate_Hz) {
  HandModel hand;
  const description::Grip grip = description::tightest_grip(session.hand);
  hand.stiffness_N_per_m = grip.stiffness_N_per_m;
  hand.damping_Ns_per_m = grip.damping_Ns_per_m;
  hand.mass_kg = session.hand.mass_kg;
  LoopModel loop = session.loop;
  const double late_s = exchanges_late / rate_Hz;
  loop.delay_s += late_s;
  try {
    require_stable_mass(session.settings.mass_kg, hand, loop, false);
  } catch (const description::SetupError& error) {
    const double delay_s = loop.delay_s + loop.period_s;
    std::fprintf(stderr,
                 "proxarm: warning: the loop through %s can't be stable at %.4g exchanges/s: %.3g ms of delay without "
                 "it + 1.5 exchanges of %.3g ms = L = %.3g ms, and with the hand's K_h L = %.4g N/m * %.3g ms = %.3g "
                 "Ns/m of %.3g Ns/m of damping; %s\n",
                 joint.c_str(), rate_Hz, 1e3 * (delay_s - late_s), 1e3 / rate_Hz, 1e3 * delay_s, hand.stiffness_N_per_m,
                 1e3 * delay_s, hand.stiffness_N_per_m * delay_s, hand.damping_Ns_per_m + loop.damping_Ns_per_m,
                 error.what());
  }
}

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

struct DriveOnLine {
  const description::DriveDescription* drive;
  description::ModbusDriveDescription registers;
};

std::vector<DriveOnLine> drives_on(const description::Cell& cell, const description::ModbusLineDescription& line) {
  std::vector<DriveOnLine> drives;
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.bus == line.name) drives.push_back({&drive, description::load_modbus_drive(drive.description)});
  }
  return drives;
}

// Returns the number of devices that take turns on the line: its drives, and the sensor if it is on this line.
int devices_on(const description::Cell& cell, const description::ModbusLineDescription& line) {
  return static_cast<int>(drives_on(cell, line).size()) + (cell.sensor.bus == line.name ? 1 : 0);
}

std::string in_ms(double time_s) { return short_text(1e3 * time_s) + " ms"; }

}  // namespace

double slowest_report_Hz(const description::Cell& cell) {
  double slowest_Hz = 0.0;
  for (const description::ModbusLineDescription& line : cell.modbus_lines) {
    for (const DriveOnLine& on_it : drives_on(cell, line)) {
      const double rate_Hz = fieldbus::modbus_expected_rate_Hz(on_it.registers, line, devices_on(cell, line));
      slowest_Hz = slowest_Hz > 0.0 ? std::min(slowest_Hz, rate_Hz) : rate_Hz;
    }
  }
  return slowest_Hz;
}

std::string modbus_plan_text(const PreparedSession& session) {
  std::string text;
  for (const description::ModbusLineDescription& line : session.cell.modbus_lines) {
    const std::vector<DriveOnLine> drives = drives_on(session.cell, line);
    const int devices = devices_on(session.cell, line);
    text += line.name + ": Modbus " + (line.serial() ? "RTU" : "TCP") + ", " + fieldbus::peer_text(line) +
            (line.serial() ? ", " + std::to_string(line.baud) + " baud" : "") + "\n";
    for (const DriveOnLine& on_it : drives) {
      const double rate_Hz = fieldbus::modbus_expected_rate_Hz(on_it.registers, line, devices);
      text += "  " + on_it.drive->joint + ", unit " + std::to_string(on_it.drive->node) + ": ";
      if (line.serial()) {
        text += in_ms(fieldbus::modbus_rtu_exchange_s(on_it.registers, line)) + " an exchange, " +
                std::to_string(devices) + (devices == 1 ? " device" : " devices") + " on the line: ";
      }
      text += short_text(rate_Hz) + " exchanges/s of " + short_text(on_it.registers.rate_Hz) +
              " wanted; a setpoint comes " + in_ms(exchanges_late / rate_Hz) + " later than on CAN\n";
      warn_if_unstable(session, on_it.drive->joint, rate_Hz);
    }
    if (session.cell.sensor.bus != line.name || !session.sensor.described || !session.sensor.described->registers)
      continue;
    double rate_Hz = session.sensor.described->rate_Hz;
    if (line.serial()) {
      const double read_s = fieldbus::modbus_rtu_read_s(session.sensor.described->registers->count, line);
      text += "  sensor: " + in_ms(read_s) + " an exchange, ";
      rate_Hz = std::min(rate_Hz, 1.0 / (devices * read_s));
    } else {
      text += "  sensor: ";
    }
    text += short_text(rate_Hz) + " samples/s\n";
  }
  return text;
}

std::string udp_plan_text(const PreparedSession& session) {
  const description::SensorPlacement& sensor = session.cell.sensor;
  if (!sensor.on_udp()) return {};
  const description::SensorProtocol& protocol = *session.sensor.described;
  return "sensor: UDP, " + fieldbus::peer_text(fieldbus::peer_of(sensor, session.sensor)) + "\n  " +
         description::number_text(protocol.rate_Hz) + " datagrams/s of " + std::to_string(protocol.sample_bytes()) +
         " bytes; a reading is up to " + in_ms(1.0 / protocol.rate_Hz) + " old when a cycle begins\n";
}

void report_modbus_rates(const PreparedSession& session, const CycleParts& parts) {
  for (const auto& line : parts.modbus_lines) {
    for (const fieldbus::ModbusDrive* drive : line->drives()) {
      const std::string& joint = drive->description().joint;
      const double rate_Hz = drive->achieved_rate_Hz();
      std::fprintf(stderr, "proxarm: %s on Modbus line %s, unit %d: %.4g exchanges/s of %.4g wanted\n", joint.c_str(),
                   line->description().name.c_str(), drive->description().node, rate_Hz, drive->registers().rate_Hz);
      if (rate_Hz > 0.0) warn_if_unstable(session, joint, rate_Hz);
    }
  }
}

}  // namespace proxarm::controller
