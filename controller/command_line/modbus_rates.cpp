#include "controller/command_line/modbus_rates.hpp"

#include <cstdio>

#include "fieldbus/modbus_drive.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::command_line {
namespace {

// A target waits for the next exchange, half of one on average, and is reached one exchange later.
constexpr double exchanges_late = 1.5;

void warn_if_unstable(const PreparedSession& session, const std::string& joint, double rate_Hz) {
  controller::HandModel hand;
  const description::Grip grip = description::tightest_grip(session.hand);
  hand.stiffness_N_per_m = grip.stiffness_N_per_m;
  hand.damping_Ns_per_m = grip.damping_Ns_per_m;
  hand.mass_kg = session.hand.mass_kg;
  controller::LoopModel loop = session.loop;
  const double late_s = exchanges_late / rate_Hz;
  loop.delay_s += late_s;
  try {
    controller::require_stable_mass(session.settings.mass_kg, hand, loop, false);
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

}  // namespace

void report_modbus_rates(const PreparedSession& session, const controller::CycleParts& parts) {
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

}  // namespace proxarm::command_line
