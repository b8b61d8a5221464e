#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "controller/extras/commands/commands.hpp"
#include "controller/extras/trials/inertia_advice.hpp"
#include "controller/extras/trials/mass_advice.hpp"
#include "controller/extras/trials/trial.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/report/progress.hpp"
#include "controller/report/summary.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using controller::delay_margin;
using controller::hand_margin;
using controller::HandModel;
using controller::LoopModel;

// Returns the felt mass, handle included, at which the loop is just stable.
std::optional<double> smallest_felt(const HandModel& hand, const LoopModel& loop) {
  const auto mass = controller::smallest_stable_mass(hand, loop);
  return mass ? std::optional<double>(*mass + loop.handle_mass_kg) : std::nullopt;
}

std::string mass_text(const std::optional<double>& mass) {
  if (!mass) return "none up to 1000 kg";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.2g kg", rounded_up(*mass));
  return text.data();
}

// Returns the least damping with which some mass is stable with margins.
std::optional<controller::DampedMass> damping_needed(const HandModel& hand, const LoopModel& loop) {
  return controller::least_damping(loop, HUGE_VAL,
                                   [&](const LoopModel& damped) { return smallest_with_margins(hand, damped); });
}

// The smallest stable mass (handle included) that the loop would have if one part of the loop, `what`, were ideal.
struct Limit {
  const char* what;
  std::optional<double> mass_without;
};

std::vector<Limit> limits(const controller::PreparedSession& session, const LoopModel& loop, const HandModel& hand) {
  const double T = loop.period_s, filter_s = controller::motion_delay_s(session) - 2.0 * T;
  const double sensor_s = std::max(0.0, loop.delay_s - T - filter_s);
  std::vector<Limit> list;
  const auto add = [&](const char* what, auto change) {
    LoopModel other = loop;
    HandModel other_hand = hand;
    change(other, other_hand);
    list.push_back({what, smallest_felt(other_hand, other)});
  };
  add("the timestep (a tenth of it)", [&](LoopModel& l, HandModel&) {
    l.period_s = 0.1 * T;
    l.delay_s -= 0.9 * T;
  });
  add("the delay of the setpoints' filter (limits.setpoint_bandwidth_Hz)", [&](LoopModel& l, HandModel&) {
    l.delay_s = std::max(0.0, l.delay_s - filter_s);
    std::vector<controller::ElasticArm> unfiltered = *l.arms;
    for (controller::ElasticArm& arm : unfiltered) arm.filter_s = 0.0;
    l.arms = std::make_shared<const std::vector<controller::ElasticArm>>(unfiltered);
  });
  add("the sensor's delay", [&](LoopModel& l, HandModel&) { l.delay_s -= sensor_s; });
  add("the drives' lag", [](LoopModel& l, HandModel&) { l.drive_time_constant_s = 0.0; });
  add("the mass after the sensor (handle and hand)", [](LoopModel& l, HandModel& h) {
    l.handle_mass_kg = 0.0;
    h.mass_kg = 0.0;
  });
  // The part that limits the mass most comes first.
  std::stable_sort(list.begin(), list.end(), [](const Limit& a, const Limit& b) {
    return a.mass_without.value_or(1e9) < b.mass_without.value_or(1e9);
  });
  return list;
}

// Returns the largest timestep at which `mass_kg` is stable with margins, as it is at all smaller ones. Only timesteps
// that drives can hold exactly are tried.
std::optional<double> timestep_for(double mass_kg, const HandModel& hand, const LoopModel& loop) {
  std::optional<double> largest;
  for (const double ms : {0.1, 0.2, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 20.0}) {
    LoopModel other = loop;
    other.period_s = 1e-3 * ms;
    other.delay_s += other.period_s - loop.period_s;
    const auto smallest = smallest_with_margins(hand, other);
    if (!smallest || *smallest > mass_kg) break;
    largest = other.period_s;
  }
  return largest;
}

// Shows on a terminal what is being searched, because `tune` takes some seconds, and a dozen with an inertia. Texts fit
// a line of 80 columns.
class Stages {
 public:
  // Shows `what` until the next stage begins or something is printed.
  void begin(const std::string& what) {
    done();
    progress_.update(begun_++, what);
  }
  void done() { progress_.clear(); }

 private:
  static constexpr int most = 13;  // largest number of stages
  controller::Progress progress_{most, stderr, "steps"};
  int begun_ = 0;
};

std::string in_poses(const std::string& what, std::size_t poses) {
  return what + ", " + std::to_string(poses) + (poses == 1 ? " pose" : " poses");
}
std::string trying(const std::string& what) { return "trying " + what; }

// The input of the advice: the hand as its file describes it, and the loop in all poses to which the hand leads the
// arm.
struct Tuned {
  const controller::PreparedSession& session;
  HandModel hand;
  LoopModel loop;
  Stages& stages;
};

Tuned tuned(const controller::PreparedSession& session, Stages& stages) {
  LoopModel loop = controller::led_loop(session);
  loop.horizon_s = 0.0;
  const HandModel hand = controller::hand_model(session, loop);
  return {session, hand, loop, stages};
}

void print_delays(const Tuned& of) {
  const HandModel& hand = of.hand;
  const double T = of.loop.period_s, filter_s = controller::motion_delay_s(of.session) - 2.0 * T;
  std::printf("%s, held by %s: %.4g N/m, %.4g Ns/m, %.3g kg; T = %.4g ms\n", of.session.cell.name.c_str(),
              of.session.hand.name.c_str(), hand.stiffness_N_per_m, hand.damping_Ns_per_m, hand.mass_kg, 1e3 * T);
  std::printf(
      "from a push to the arm being there: %.3g ms (sampling %.3g, reaching the target %.3g, setpoint filter %.3g, "
      "sensor %.3g, drives %.3g)\n",
      1e3 * controller::total_delay_s(of.session), 1e3 * T, 1e3 * T, 1e3 * filter_s,
      1e3 * std::max(0.0, of.loop.delay_s - T - filter_s), 1e3 * of.loop.drive_time_constant_s);
}

void print_mass(const Tuned& of, const std::optional<double>& smallest) {
  LoopModel start = of.session.loop;  // the loop in the start pose
  start.horizon_s = 0.0;
  const std::string at_start = mass_text(smallest_felt(of.hand, start));
  of.stages.done();
  std::printf(
      "smallest stable mass: %s felt, handle's %.3g kg included; %s in the start pose alone, by which `run` refuses\n",
      mass_text(smallest).c_str(), of.loop.handle_mass_kg, at_start.c_str());
  if (const auto layer = controller::decisive_layer(of.hand, of.loop)) {
    LoopModel free = of.loop;
    free.layers = nullptr;
    std::printf("  that is what %s asks for; %s in free motion\n", layer->what.c_str(),
                mass_text(smallest_felt(of.hand, free)).c_str());
  }
  of.stages.begin(in_poses("mass with margins", of.loop.arms->size()));
  const auto safe = smallest_with_margins(of.hand, of.loop);
  if (safe) of.stages.begin(trying(mass_text(safe)));
  const TriedAdvice tried = safe ? tried_mass(of.session, rounded_up(*safe)) : TriedAdvice{};
  of.stages.done();
  if (safe && !tried.steady) {
    std::printf("advice: none: no mass from %s on that was tried was steady\n", mass_text(safe).c_str());
  } else {
    std::printf("advice: %s%s with a hand %.1f times as stiff and as heavy and %.0f %% more delay\n",
                tried.steady ? ("--mass " + mass_text(tried.steady)).c_str() : "no mass up to 1000 kg",
                tried.steady ? ", which is stable" : " is stable", hand_margin, 100.0 * (delay_margin - 1.0));
  }
  if (safe) std::printf("tried on the simulated arm: %s\n", tried.text.c_str());
}

std::string inertia_text(const std::optional<double>& inertia_kg_m2) {
  if (!inertia_kg_m2) return "none";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.2g kg m²", rounded_up(*inertia_kg_m2));
  return text.data();
}

// Tries an inertia of at least `least_kg_m2` on the simulated arm, and prints the advice. `also`: a further option that
// this inertia needs.
void print_tried_inertia(const controller::PreparedSession& session, double least_kg_m2, const std::string& also,
                         Stages& stages) {
  stages.begin(trying(inertia_text(least_kg_m2)));
  const TriedAdvice tried = tried_inertia(session, rounded_up(least_kg_m2));
  stages.done();
  const double mass_kg = session.settings.mass_kg;
  if (tried.steady) {
    std::printf("advice: with %.3g kg --inertia %s%s, with the same margins\n", mass_kg,
                inertia_text(tried.steady).c_str(), also.c_str());
  } else {
    std::printf("advice: none: with %.3g kg no inertia from %s%s on that was tried was steady\n", mass_kg,
                inertia_text(least_kg_m2).c_str(), also.c_str());
  }
  std::printf("tried on the simulated arm: %s\n", tried.text.c_str());
}

// Prints the smallest of six turning dampings with which some inertia is stable with margins. With the hand's stiffness
// K, the hand's damping D and the loop delay L: if K L > D, no inertia is stable without additional damping.
void print_turning_damping(controller::PreparedSession session, Stages& stages) {
  stages.begin("inertia with more damping");
  const double own = session.settings.rotational_damping_Nms_per_rad;
  for (const double damping : {0.1, 0.2, 0.5, 1.0, 2.0, 5.0}) {
    if (!(damping > own)) continue;
    session.settings.rotational_damping_Nms_per_rad = damping;
    const std::optional<double> least = smallest_inertias(session).with_margins;
    if (!least) continue;
    std::array<char, 60> also{};
    std::snprintf(also.data(), also.size(), " and --turning-damping %.2g Nms/rad", damping);
    return print_tried_inertia(session, *least, also.data(), stages);
  }
  stages.done();
  std::printf("advice: a larger mass; with %.3g kg no inertia is stable with these margins\n",
              session.settings.mass_kg);
}

// Prints the advised inertia for a tool that is moved and turned at once, with the requested mass.
void print_inertia(const Tuned& of) {
  const controller::PreparedSession& session = of.session;
  if (session.settings.orientation == controller::OrientationMode::held) return;
  if (!controller::turned_model(session)) {
    std::printf("inertia: this hand doesn't turn the tool (turning_stiffness_Nm_per_rad in its file)\n");
    return;
  }
  of.stages.begin(in_poses("inertia with margins", of.loop.arms->size()));
  const SmallestInertias smallest = smallest_inertias(session);
  of.stages.done();
  std::printf(
      "smallest stable inertia with %.3g kg: %s felt, handle's %.2g kg m² included; %s in the start pose alone, by "
      "which `run` refuses\n",
      session.settings.mass_kg, inertia_text(smallest.everywhere).c_str(),
      controller::turning_loop(session).handle_mass_kg, inertia_text(smallest.at_start).c_str());
  if (smallest.with_margins) return print_tried_inertia(session, *smallest.with_margins, "", of.stages);
  print_turning_damping(session, of.stages);
}

void print_tried_damping(const Tuned& of, const controller::DampedMass& damped) {
  controller::PreparedSession session = of.session;
  session.settings.damping_Ns_per_m = damped.damping_Ns_per_m;
  of.stages.begin(trying(mass_text(damped.mass_kg)));
  const TriedAdvice tried = tried_mass(session, rounded_up(damped.mass_kg));
  of.stages.done();
  std::printf("  tried: %s\n", tried.text.c_str());
}

// Prints the least damping with which some mass is stable with margins. Precondition: without damping no mass is.
void print_needed_damping(const Tuned& of) {
  of.stages.begin("damping with margins");
  const auto needed = damping_needed(of.hand, of.loop);
  of.stages.done();
  if (!needed) {
    std::printf("damping: not even %.3g Ns/m gives it these margins: shorten the delay\n",
                std::max(controller::tried_dampings.back(), of.loop.damping_Ns_per_m));
    return;
  }
  std::printf("damping: --damping %.3g Ns/m gives it these margins, from %s on\n", needed->damping_Ns_per_m,
              mass_text(needed->mass_kg).c_str());
  print_tried_damping(of, *needed);
}

void print_damping(const Tuned& of) {
  of.stages.begin("damping with margins");
  const auto without = smallest_with_margins(of.hand, of.loop);
  if (!without) return print_needed_damping(of);
  const auto worthwhile = worthwhile_damping(of.hand, of.loop);
  of.stages.done();
  if (worthwhile) {
    std::printf("damping: %s with --damping %.3g Ns/m, or %s without\n", mass_text(worthwhile->mass_kg).c_str(),
                worthwhile->damping_Ns_per_m, mass_text(without).c_str());
    return print_tried_damping(of, *worthwhile);
  }
  std::printf(
      "damping: none needed for stability; on curved surfaces T f/R cancels what (26) gains outside a curvature "
      "R: %.2g Ns/m at 20 N and 0.1 m\n",
      of.loop.period_s * 20.0 / 0.1);
}

// Prints by how much each part of the loop limits the smallest mass. Returns the part that limits the mass most, in
// words.
std::string print_limits(const Tuned& of, const std::optional<double>& smallest) {
  of.stages.begin(in_poses("what limits the mass", of.loop.arms->size()));
  const auto sorted = limits(of.session, of.loop, of.hand);
  of.stages.done();
  // A part of the loop is said to limit the mass if without that part the mass is smaller by a tenth or more (`gain`).
  constexpr double no_mass = 1e9, gain = 0.9;
  const bool helps = sorted.front().mass_without.value_or(no_mass) < gain * smallest.value_or(0.5 * no_mass);
  const std::string limit = helps ? sorted.front().what : "none of these alone";
  std::printf("what limits it: %s; without %s the smallest stable mass would be %s\n", limit.c_str(),
              helps ? "it" : sorted.front().what, mass_text(sorted.front().mass_without).c_str());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    std::printf("  without %s: %s\n", sorted[i].what, mass_text(sorted[i].mass_without).c_str());
  }
  return limit;
}

void print_timestep(const Tuned& of, const controller::RunOptions& options, const std::string& limit) {
  const double wanted = of.session.settings.mass_kg;
  of.stages.begin("timestep with margins");
  const auto timestep = timestep_for(wanted, of.hand, of.loop);
  of.stages.done();
  if (timestep) {
    const bool carried = controller::is_carried(controller::with_timestep(of.session, options, *timestep));
    std::printf("for %.3g kg with these margins: a timestep of at most %.4g ms%s\n", wanted, 1e3 * *timestep,
                carried ? "" : ", which the cell's buses can't carry");
  } else {
    std::printf("for %.3g kg with these margins: no timestep is short enough; in the way: %s\n", wanted, limit.c_str());
  }
}

}  // namespace

int tune_command(const controller::RunOptions& options) {
  const controller::PreparedSession session = controller::prepare(options);
  controller::require_carried(session, options);
  if (session.impedance()) {
    throw description::SetupError({.file = session.cell.file.string(),
                                   .key = "tune",
                                   .found = "a cell of the impedance type",
                                   .expected = "one whose drives take positions: `run` judges a coupling's K and B"});
  }
  controller::warn_of_surprises(session);
  controller::require_usable_start(session);
  controller::require_inertia_in_range(session);
  Stages stages;
  stages.begin("poses of the hand");
  Tuned of = tuned(session, stages);
  stages.done();
  print_delays(of);
  stages.begin(in_poses("smallest mass", of.loop.arms->size()));
  const auto smallest = smallest_felt(of.hand, of.loop);
  of.loop = controller::with_worst_layers(of.hand, of.loop, smallest.value_or(session.settings.mass_kg));
  print_mass(of, smallest);
  print_inertia(of);
  print_damping(of);
  stages.begin("lookahead");
  const double horizon_s = controller::longest_horizon_s(session);
  stages.done();
  std::printf("lookahead: --lookahead auto sends the arm %.3g ms ahead of the proxy at %.3g kg\n", 1e3 * horizon_s,
              session.settings.mass_kg);
  print_timestep(of, options, print_limits(of, smallest));
  return smallest ? 0 : 1;
}

}  // namespace proxarm::command_line
