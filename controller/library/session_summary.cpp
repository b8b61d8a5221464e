#include "controller/library/session_summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/live/live_parameters.hpp"
#include "controller/live/orders.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/signals/clearances.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::controller {

std::vector<std::string> joint_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::DriveDescription& drive : cell.drives) names.push_back(drive.joint);
  return names;
}

SummaryConfig summary_config(const PreparedSession& session) {
  SummaryConfig config;
  config.period_s = session.settings.period_s;
  config.wanted_mass_kg = session.settings.mass_kg;
  if (!session.impedance()) config.handle_mass_kg = session.cell.tool.mass_kg;
  config.damping_Ns_per_m = session.settings.damping_Ns_per_m;
  config.spring_N_per_m = session.settings.spring_N_per_m;
  if (session.settings.orientation == OrientationMode::free) {
    config.wanted_inertia_kg_m2 = felt_inertia_kg_m2(session);
    config.turning_spring_Nm_per_rad = session.settings.rotational_spring_Nm_per_rad;
  }
  // What is looked ahead isn't behind.
  config.lookahead_s = session.settings.horizon_s;
  config.gear_damping_per_s = session.settings.gear_damping_per_s;
  config.setpoint_filter_s = motion_delay_s(session) - 2.0 * session.settings.period_s - session.settings.horizon_s;
  const double behind_s = std::max(0.0, motion_delay_s(session) - session.settings.horizon_s);
  config.setpoint_delay_cycles = static_cast<int>(std::lround(behind_s / session.settings.period_s));
  config.passivity = session.settings.passivity != Passivity::off;
  config.axis_names = joint_names(session.cell);
  return config;
}

void complete(CycleRecord& record, const PreparedSession& session, std::int64_t rendered_ns) {
  if (session.rigid) return add_clearances(record, *session.rigid, rendered_ns);
  add_clearances(record, session.scene, *session.clearances, rendered_ns);
  if (!session.impedance()) return;
  for (RecordedContact& contact : record.contacts) {
    const auto object = static_cast<std::size_t>(contact.object);
    if (contact.object >= 0 && object < session.scene.objects.size()) {
      contact.friction = session.scene.objects[object].friction;
    }
  }
}

namespace {

// Which cable, what was wrong with what came through it, and what the sensor says itself.
std::string sensor_text(const FaultReport& report, const fieldbus::ForceSensor& sensor, const std::string& where) {
  std::string text = where;
  if (report.fault == Fault::sensor_status) {
    text += ": " + sensor.describe_status(static_cast<std::uint32_t>(report.value));
  } else if (report.fault == Fault::sensor_lost || report.fault == Fault::sensor_late) {
    const std::string losses = sensor.describe_losses();
    text += losses.empty() ? ": no faulty frame" : ": so far " + losses;
  }
  return text;
}

bool is_of_sensor(Fault fault) noexcept {
  return fault == Fault::sensor_lost || fault == Fault::sensor_late || fault == Fault::sensor_status ||
         fault == Fault::sensor_saturated || fault == Fault::sensor_frozen || fault == Fault::sensor_drifts ||
         fault == Fault::force_reversed || fault == Fault::force_jumped;
}

std::string place_of(const FaultReport& report, const CycleParts& parts, const description::Cell& cell) {
  if (is_of_sensor(report.fault)) return sensor_text(report, *parts.sensor, cell.sensor.where());
  if (report.fault == Fault::force_at_start) return standing_force_text(report, cell.gravity_W_m_per_s2);
  if (report.where < 0) return "";
  const auto where = static_cast<std::size_t>(report.where);
  if (report.fault == Fault::bus_off || report.fault == Fault::error_passive || report.fault == Fault::interface_down ||
      report.fault == Fault::send_failed || report.fault == Fault::receive_overflow) {
    return "bus " + parts.network.bus(where).name();
  }
  if (report.fault == Fault::second_master) {
    char id[8];
    std::snprintf(id, sizeof id, "%03Xh", static_cast<unsigned>(report.value));
    return "bus " + parts.network.bus(where).name() + ", identifier " + id;
  }
  const fieldbus::CyclicDrive& drive = parts.drives[where].drive;
  std::string place = "drive of " + drive.description().joint + ", bus " + drive.description().bus + ", node " +
                      std::to_string(drive.description().node);
  if (report.fault == Fault::drive_fault || report.fault == Fault::drive_disabled ||
      report.fault == Fault::drive_not_enabled || report.fault == Fault::modbus_silent) {
    place += ": " + drive.describe();
  }
  return place;
}

// What ended the session. A drive that doesn't confirm that it is off is told of by what a fault's text says then.
FaultSummary final_fault(const Cycle& cycle, const description::Cell& cell) {
  const auto place = [&](const FaultReport& r) { return place_of(r, cycle.parts(), cell); };
  const FaultReport& report = cycle.supervisor().report();
  const FaultReport& then = cycle.supervisor().escalation();
  FaultSummary fault;
  fault.fault = report.fault;
  fault.cycle = report.cycle;
  if (then.fault == Fault::none || then.fault == Fault::drive_not_disabled) {
    fault.text = describe(report, place(report), cycle.drives_off());
  } else {
    fault.text = describe(report, place(report), then, place(then), cycle.drives_off());
    fault.escalation = then.fault;
  }
  return fault;
}

// The session's end in words; one that somebody asked for has its own.
EndSummary end_summary(SessionEnd end, const EndSummary& asked, const PreparedSession& session, double rendered_s) {
  char text[160], of_wanted[64];
  std::snprintf(of_wanted, sizeof of_wanted, "; %.4g of %.4g s were rendered", rendered_s, session.duration_s);
  switch (end) {
    case SessionEnd::duration:
      std::snprintf(text, sizeof text, "%.4g s were rendered, as asked for", session.duration_s);
      return {"duration", text};
    case SessionEnd::asked:
      return {asked.reason, "stopped: " + asked.text + of_wanted};
    case SessionEnd::hold_expired:
      std::snprintf(text, sizeof text, "nobody ended the hold within %.4g s (supervision.hold_s)",
                    session.cell.supervision.hold_s);
      return {"hold_expired", std::string(text) + of_wanted};
    case SessionEnd::release_expired:
      std::snprintf(text, sizeof text, "a release that no order could end any more lasted for %.4g s",
                    session.duration_s);
      return {"release_expired", std::string(text) + of_wanted};
    case SessionEnd::fault:
      return {"fault", std::string("stopped by a fault") + of_wanted};
  }
  return {};
}

void add_faults(Summary& summary, const Cycle& cycle, const description::Cell& cell) {
  for (const FaultReport& report : cycle.past_faults()) {
    summary.faults.push_back(
        {report.fault, report.cycle, describe(report, place_of(report, cycle.parts(), cell)), true});
  }
  if (cycle.supervisor().report().fault != Fault::none) {
    summary.faults.push_back(final_fault(cycle, cell));
    const std::string& brakes = cell.supervision.brake_release;
    if (!brakes.empty()) summary.faults.back().text += "; somebody pinned: open the brakes by " + brakes;
  }
  for (std::size_t i = 1; i < fault_count; ++i) {
    const auto fault = static_cast<Fault>(i);
    const Notice& notice = cycle.supervisor().notice(fault);
    const Reaction reaction = cycle.supervisor().reaction(fault);
    if (notice.times == 0 || reaction >= Reaction::stop_1) continue;
    summary.notices.push_back({fault, reaction, notice.times, notice.cycles});
  }
}

}  // namespace

SessionLength session_length(const PreparedSession& session, const RunOptions& options) {
  SessionLength length{session.duration_s};
  const bool somebody_presses =
      session.cell.enabling_input && !session.settings.without_enabling_input && !options.bus.simulated();
  if (options.control.empty() && !somebody_presses) length.longest_release_s = session.duration_s;
  return length;
}

std::string rendered_text(const PreparedSession& session) {
  const SessionSettings& s = session.settings;
  char text[96];
  if (session.impedance()) {
    std::snprintf(text, sizeof text, "impedance type, K = %.4g N/m, B = %.4g Ns/m", s.coupling_stiffness_N_per_m,
                  s.coupling_damping_Ns_per_m);
  } else {
    std::snprintf(text, sizeof text, "%.4g kg felt", s.mass_kg);
  }
  return text;
}

std::string plot_title(const PreparedSession& session) {
  char period[32];
  std::snprintf(period, sizeof period, ", T = %.4g ms", 1e3 * session.settings.period_s);
  return session.scene.name + ": " + rendered_text(session) + period;
}

Summary session_summary(SummaryBuilder& builder, const Cycle& cycle, SessionEnd end, const EndSummary& asked,
                        const PreparedSession& session) {
  Summary summary = builder.finish();
  summary.end = end_summary(end, asked, session, summary.rendered_time_s);
  summary.drives_lack = fieldbus::losses_of(cycle.parts().can_drives);
  // A medium takes its share along the surface, too, which the ratio would count as friction.
  if (!session.scene.media.empty() || session.scene.coulomb_force_N) summary.friction_ratio_error.reset();
  add_faults(summary, cycle, session.cell);
  return summary;
}

void add_idle_orders(Summary& summary, const Cycle& cycle, const RunOptions& options) {
  for (const ScheduledCommand& order : cycle.scheduled_commands()) {
    if (order.taken && order.refusal == nullptr) continue;
    summary.idle_orders.push_back({order_name(order.request.order), static_cast<double>(order.at_ns) / 1e9,
                                   order.taken ? order.refusal : "the session had ended before"});
  }
  for (const IdleChange& change : idle_changes(cycle, options.changes)) {
    summary.idle_orders.push_back({"set " + change.text, change.time_s, change.refusal});
  }
}

}  // namespace proxarm::controller
