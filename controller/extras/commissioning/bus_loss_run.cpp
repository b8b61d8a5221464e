#include "controller/extras/commissioning/bus_loss_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/command_line/sessions/interface_network.hpp"
#include "controller/extras/commissioning/arm_at_hand.hpp"
#include "controller/extras/proof/bus_loss.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/live/realtime.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/proof_file.hpp"
#include "controller/session/bring_up.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {
namespace {

using description::Json;
using proof::OwnStop;

// Allowance for the measured time. A drive measures the silence by its own clock, and the drive's stop is seen only in
// the drive's next frame.
constexpr double drives_own_clock_s = 0.005;

struct Outcome {
  std::vector<OwnStop> stops;
  controller::FaultReport fault;
  bool real_arm = false;
};

void require_drives_on_can(const description::Cell& cell) {
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.on_can()) continue;
    throw description::SetupError({.file = cell.file.string(),
                                   .key = "--bus-loss",
                                   .found = "the drive of " + drive.joint + " on a Modbus line",
                                   .expected = "drives on CAN: what others do without a controller is their makers'"});
  }
}

template <typename Asks>
Outcome run(proof::BusLossSession& session, fieldbus::CanNetwork& network, double period_s, const Asks& asks) {
  const std::int64_t period_ns = std::llround(1e9 * period_s);
  std::int64_t t_k_ns = network.now_ns() + period_ns;
  bool asked = false;
  while (!session.done()) {
    network.sleep_until(t_k_ns);
    session.run_cycle(t_k_ns);
    if (!asked && session.asks_for_press()) asks();
    asked = asked || session.asks_for_press();
    t_k_ns += period_ns;
    const std::int64_t late_ns = network.now_ns() - t_k_ns;
    if (late_ns <= 0) continue;
    t_k_ns += (late_ns / period_ns + 1) * period_ns;
    if (late_ns > 10 * period_ns && !session.silent()) session.request_stop();
  }
  session.ask_the_others();
  session.shut_down();
  return {session.own_stops(), session.fault(), false};
}

Outcome in_simulation(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                      const controller::RunOptions& options) {
  SimulatedArm simulated(arm, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  controller::CycleParts parts = controller::build_parts(
      session.cell, session.sensor, scene, session.settings, simulated.network,
      controller::buses_in_order(session.cell), controller::opener_of(fieldbus::ModbusPeers::on_this_machine),
      [&](const auto&) { return simulated.far_end.datagram_port(); });
  simulated.power_on();
  controller::bring_up(parts);
  fieldbus::ask_for_words(simulated.network, parts.can_drives);
  proof::BusLossSession silence(std::move(parts), session.settings, session.cell);
  return run(silence, simulated.network, session.settings.period_s, [] {});
}

Outcome on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options) {
  ArmOnInterfaces arm(session, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings,
                                                         arm.network, indices_in(arm.network, arm.interfaces.size()),
                                                         controller::opener_of(fieldbus::ModbusPeers::on_this_machine),
                                                         controller::opener_of(fieldbus::UdpPeers::any));
  bring_up_devices(arm.network, parts, [&](std::size_t bus) {
    std::vector<std::uint32_t> ids;
    for (const fieldbus::DriveSlot& slot : parts.can_drives) {
      if (slot.bus == bus) ids.push_back(fieldbus::SilenceWatch(*slot.drive).wanted_id());
    }
    return ids;
  });
  fieldbus::ask_for_words(arm.network, parts.can_drives);
  proof::BusLossSession silence(std::move(parts), session.settings, session.cell);
  controller::SignalWatch signals([&] { silence.request_stop(); });
  Outcome outcome;
  {
    const controller::RealtimeThread realtime;
    outcome = run(silence, arm.network, session.settings.period_s,
                  [] { std::fprintf(stderr, "let go of the enabling switch, then press it and keep it so\n"); });
  }
  outcome.real_arm = controller::is_real(session, arm.interfaces);
  return outcome;
}

// Returns how a drive failed; empty if the drive stopped by itself within `promised_s`.
std::string failure_of(const OwnStop& stop, double promised_s) {
  if (!stop.off_at_last) return "is still enabled";
  if (stop.reacts_s < 0.0) return "is off at last, but nothing on the bus said when";
  if (stop.reacts_s > promised_s + drives_own_clock_s) return "stops too late";
  return "";
}

std::string line_of(const OwnStop& stop, const std::string& failure) {
  char text[160];
  std::snprintf(text, sizeof text, "  %-10s %6.1f ms  %s%s%s\n", stop.joint.c_str(), 1e3 * std::max(stop.reacts_s, 0.0),
                stop.signs.c_str(), failure.empty() ? "" : ": ", failure.c_str());
  return text;
}

void tell(const std::vector<OwnStop>& stops, double promised_s, bool proven, const std::string& failure) {
  if (!stops.empty()) {
    std::printf("how each drive stopped, and when after the controller's last word (%.3g ms promised):\n",
                1e3 * promised_s);
  }
  for (const OwnStop& stop : stops) std::fputs(line_of(stop, failure_of(stop, promised_s)).c_str(), stdout);
  if (!failure.empty()) std::printf("%s\n", failure.c_str());
  std::printf("%s\n", proven ? "ALL DRIVES STOP BY THEMSELVES" : "NOT PROVEN");
}

Json json_of(const std::vector<OwnStop>& stops, double promised_s, bool proven, const std::string& failure) {
  Json json{{"proven", proven}, {"failure", failure}, {"promised_s", promised_s}, {"drives", Json::array()}};
  for (const OwnStop& stop : stops) {
    json["drives"].push_back({{"joint", stop.joint},
                              {"stops_after_s", stop.reacts_s < 0.0 ? Json() : Json(stop.reacts_s)},
                              {"off_after_s", stop.off_s < 0.0 ? Json() : Json(stop.off_s)},
                              {"by", stop.signs},
                              {"failure", failure_of(stop, promised_s)}});
  }
  return json;
}

// Adds the stops to the cell's proof. Returns whether the file also holds the rest of the proof.
bool keep(const controller::PreparedSession& session, const Outcome& outcome, const std::filesystem::path& file) {
  const std::string hash = controller::cell_sha256(session);
  controller::ProofFile proof{hash, outcome.real_arm, controller::today(), "drives stop without the controller", false,
                              {}};
  if (const auto kept = controller::kept_proof(file, hash, outcome.real_arm)) proof = *kept;
  proof.bus_loss.clear();
  for (const OwnStop& stop : outcome.stops) proof.bus_loss.push_back({stop.joint, 1e3 * stop.reacts_s, stop.signs});
  controller::write_proof(file, proof);
  return proof.whole;
}

}  // namespace

int prove_bus_loss(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                   const controller::RunOptions& options, const std::filesystem::path& file) {
  require_drives_on_can(session.cell);
  const Outcome outcome =
      options.bus.simulated() ? in_simulation(session, arm, options) : on_interfaces(session, options);
  const double promised_s = session.cell.supervision.bus_loss_stop_s;
  std::string failure;
  if (outcome.stops.empty()) {
    failure = outcome.fault.fault == controller::Fault::none ? "the session ended before the silence"
                                                             : controller::describe(outcome.fault, "");
  }
  const bool proven = failure.empty() && std::all_of(outcome.stops.begin(), outcome.stops.end(), [&](const OwnStop& s) {
                        return failure_of(s, promised_s).empty();
                      });
  if (options.json) {
    std::printf("%s\n", json_of(outcome.stops, promised_s, proven, failure).dump().c_str());
  } else {
    tell(outcome.stops, promised_s, proven, failure);
  }
  if (!proven) return 1;
  const bool whole = keep(session, outcome, file);
  if (options.json) return 0;
  std::printf("kept in %s\n", file.c_str());
  if (!whole) {
    std::printf(
        "still missing there: signs, ratios, sensor and brakes, without which `proxarm run --hardware` is refused; "
        "the same command without --bus-loss proves them\n");
  }
  return 0;
}

}  // namespace proxarm::command_line
