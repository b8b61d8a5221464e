#include "controller/extras/trials/trial_run.hpp"

#include <algorithm>
#include <cmath>

#include "controller/library/simulated_loop.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/session.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "scenes/compiler/compile.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {
namespace {

using assessment::Stop;

// Time from the end of the tare and of the force's ramp to the hand's first motion.
constexpr double lead_from_s = 0.3;
// The hand leads the tool for lead_s on a minimum-jerk path. The path's greatest speed is 15/8 of the mean speed, and
// 1.2 times the tool's speed limit. So in the middle of the path the tool moves at its speed limit.
constexpr double lead_s = 0.94, lead_over_limit = 1.2, peak_of_minimum_jerk = 15.0 / 8.0;
// How long a trial is observed after the stop, and after the tool has met a body. The second time is four times the
// duration up to which a contact counts as short.
constexpr double after_stop_s = 1.0, after_contact_s = 4.0 * assessment::quasi_static_from_s;

double ramp_s(const controller::PreparedSession& session) {
  return session.settings.tare_s + session.cell.supervision.ramp_in_s + lead_from_s;
}

description::HandDescription hand_of(const controller::PreparedSession& session, const assessment::Trial& trial) {
  const description::Grip grip = description::tightest_grip(session.hand);
  description::HandDescription hand;
  hand.name = session.hand.name;
  hand.mass_kg = session.hand.mass_kg;
  hand.stiffness_N_per_m = grip.stiffness_N_per_m;
  hand.damping_Ns_per_m = grip.damping_Ns_per_m;
  const double speed_m_per_s = lead_over_limit * session.cell.limits.max_tool_speed_m_per_s;
  const models::Vec3 way = speed_m_per_s * lead_s / peak_of_minimum_jerk * trial.direction_W;
  const double from_s = ramp_s(session);
  hand.waypoints = {{from_s, {0.0, 0.0, 0.0}}, {from_s + lead_s, {way.x(), way.y(), way.z()}}};
  // At a stop the hand lets go, like a startled person: its grip fades evenly over a tenth of a second. So the measured
  // motion is the arm's own.
  if (trial.stop != Stop::none) hand.grips = {{trial.at_s, 0.0, 0.0}};
  return hand;
}

double seen_s(const controller::PreparedSession& session, const assessment::Trial& trial) {
  if (trial.stop != Stop::none) return trial.at_s + after_stop_s;
  if (trial.body.stiffness_N_per_m > 0.0) return trial.at_s + after_contact_s;
  return ramp_s(session) + lead_s;
}

void begin_stop(Stop stop, controller::Cycle& cycle, sim::SimulatedCell& far_end) {
  if (stop == Stop::category_0) far_end.cut_power();
  if (stop == Stop::category_1) cycle.request_stop();
  if (stop == Stop::category_2) cycle.commands().push({controller::Order::hold});
}

std::string end_of(const controller::Supervisor& supervisor) {
  using controller::Fault;
  if (supervisor.faulted()) return controller::fault_name(supervisor.report().fault);
  return supervisor.held_for().fault == Fault::none ? "" : controller::fault_name(supervisor.held_for().fault);
}

// Runs a trial on the simulated arm, with the trial's body and stop. The times of the result count from the hand's
// start.
class TrialArm {
 public:
  TrialArm(const controller::PreparedSession& session, const assessment::Trial& trial)
      : trial_(trial),
        seen_s_(seen_s(session, trial)),
        network_(sim::simulated_buses(session.cell)),
        far_end_(session.cell, session.sensor, hand_of(session, trial), network_.events()) {
    const assessment::Body& body = trial.body;
    if (body.stiffness_N_per_m > 0.0) {
      far_end_.plant().set_clamp({body.surface_W, body.normal_W, body.stiffness_N_per_m, body.felt});
    }
    far_end_.set_observer([this](const sim::Truth& truth) {
      if (!truth.hand_started || since_hand_s(truth) > seen_s_) return;
      result_.samples.push_back({since_hand_s(truth), truth.X_WT.translation(), truth.velocity_W});
    });
    far_end_.attach_to(network_);
    far_end_.power_on();
  }

  assessment::TrialResult run(const controller::PreparedSession& session) {
    scenes::CompiledScene scene = scenes::compile(session.scene);
    const auto open_line = [this](const description::ModbusLineDescription& line, double) {
      return far_end_.modbus_client(line.name);
    };
    controller::CycleParts parts = controller::build_parts(
        session.cell, session.sensor, scene, session.settings, network_, controller::buses_in_order(session.cell),
        open_line, [this](const auto&) { return far_end_.datagram_port(); });
    controller::bring_up(parts,
                         [this](fieldbus::ModbusLine& line) { controller::pump(network_, line, network_.now_ns()); });
    controller::Cycle cycle(std::move(parts), session.settings, session.cell.limits, 64);
    const controller::SessionHooks hooks{[&](std::int64_t) { intervene(cycle); },
                                         [&] {
                                           controller::CycleRecord record;
                                           while (cycle.records().pop(record)) continue;
                                         }};
    controller::run_session(cycle, network_, {seen_s_ + 1.0}, hooks);
    result_.end = end_.empty() ? end_of(cycle.supervisor()) : end_;
    // If a fault has ended the session early, the arm is observed on until seen_s_.
    const sim::Truth truth = far_end_.truth();
    const auto rest_ns = static_cast<std::int64_t>(1e9 * std::max(0.0, seen_s_ - since_hand_s(truth)));
    network_.sleep_until(network_.now_ns() + rest_ns);
    static_cast<void>(far_end_.truth());  // advances the physics to that time
    return std::move(result_);
  }

 private:
  static double since_hand_s(const sim::Truth& truth) {
    return 1e-9 * static_cast<double>(truth.time_ns - truth.hand_start_ns);
  }

  // Begins the trial's stop when it is due, and ends the session when the observation ends. Called before each cycle.
  void intervene(controller::Cycle& cycle) {
    const sim::Truth truth = far_end_.truth();
    if (!truth.hand_started) return;
    const double now_s = since_hand_s(truth);
    if (trial_.stop != Stop::none && !stopped_ && now_s >= trial_.at_s) {
      stopped_ = true;
      result_.stopped_at_s = now_s;
      begin_stop(trial_.stop, cycle, far_end_);
    }
    if (now_s < seen_s_ || cycle.stop_requested()) return;
    end_ = end_of(cycle.supervisor());
    cycle.request_stop();
  }

  const assessment::Trial& trial_;
  double seen_s_;
  fieldbus::SimulatedCanNetwork network_;
  sim::SimulatedCell far_end_;
  assessment::TrialResult result_;
  std::string end_;
  bool stopped_ = false;
};

}  // namespace

assessment::TrialResult run_trial(const controller::PreparedSession& session, const assessment::Trial& trial) {
  controller::PreparedSession there = session;
  there.cell.start_rad = trial.start_rad;
  return TrialArm(there, trial).run(there);
}

}  // namespace proxarm::command_line
