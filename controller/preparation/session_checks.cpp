#include "controller/preparation/session_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "controller/preparation/session_loops.hpp"
#include "controller/rendering/torque_rendering.hpp"
#include "fieldbus/cia402/cia402_units.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/arm/tool_space.hpp"
#include "models/files/key_line.hpp"

namespace proxarm::controller {
namespace {

// With a shorter period no computer keeps the cycle; with a longer one a contact no longer feels like touch.
constexpr double shortest_period_s = 50e-6, longest_period_s = 0.1;

// The largest mass that a session may have. For larger masses stability isn't computed, because numbers would overflow.
constexpr double heaviest_kg = 10'000.0;

void require_mass_in_range(const PreparedSession& session, const RunOptions& options) {
  const double mass_kg = session.settings.mass_kg;
  if (mass_kg <= heaviest_kg) return;
  throw description::SetupError({.file = options.mass_kg ? "" : session.cell.file.string(),
                                 .key = options.mass_kg ? "mass" : "default_mass_kg",
                                 .found = description::number_text(mass_kg) + " kg",
                                 .expected = "at most " + description::number_text(heaviest_kg) + " kg"});
}

// Throws SetupError if the requested horizon is longer than the one that `auto` would choose.
void require_stable_horizon(const PreparedSession& session) {
  if (session.lookahead.kind != LookaheadChoice::Kind::fixed) return;
  const double longest_s = longest_horizon_s(session);
  if (session.settings.horizon_s <= longest_s) return;
  std::array<char, 80> found{}, expected{};
  std::snprintf(found.data(), found.size(), "%.4g ms with %.4g kg", 1e3 * session.settings.horizon_s,
                session.settings.mass_kg);
  std::snprintf(expected.data(), expected.size(), "at most %.4g ms, which is stable with margins", 1e3 * longest_s);
  throw description::SetupError({.key = "--lookahead",
                                 .found = found.data(),
                                 .expected = expected.data(),
                                 .advice = "--lookahead auto, or a larger --mass (--force-unstable overrides, in "
                                           "simulation)"});
}

// Throws SetupError unless the virtual coupling's K and B at a wall are stable without a hand, in the device's lightest
// and heaviest direction.
void require_stable_coupling(const PreparedSession& session) {
  const SessionSettings& settings = session.settings;
  const models::Arm arm(session.cell);
  const models::TipMass tip = arm.effective_mass_range(arm.start_rad(), models::tool_space(arm).dimensions);
  ImpedanceConfig config{.stiffness_N_per_m = settings.coupling_stiffness_N_per_m,
                         .damping_Ns_per_m = settings.coupling_damping_Ns_per_m,
                         .period_s = settings.period_s};
  config.validate();
  for (const double mass_kg : {tip.min_kg, tip.max_kg}) {
    if (coupling_spectral_radius(config, mass_kg) < 1.0) continue;
    std::array<char, 160> found{};
    std::snprintf(found.data(), found.size(), "%.4g N/m and %.4g Ns/m, unstable at the %.3g kg of the device's tip",
                  config.stiffness_N_per_m, config.damping_Ns_per_m, mass_kg);
    const double least_damping = 1.5 * config.stiffness_N_per_m * config.period_s;
    throw description::SetupError(
        {.key = "--stiffness",
         .found = found.data(),
         .expected = "a coupling that is stable without a hand: damping above " +
                     description::number_text(std::ceil(100.0 * least_damping) / 100.0) +
                     " Ns/m for this stiffness (3KT/2, the loop's delay), and not much more than M/T",
         .advice = "lower --stiffness, change --damping, or take a shorter --timestep"});
  }
}

}  // namespace

description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options) {
  if (options.period_s) return {.key = "--timestep"};
  return {.file = cell.file.string(),
          .line = description::line_of_key(cell.file, "default_period_s"),
          .key = "default_period_s"};
}

void require_period(const PreparedSession& session, const RunOptions& options) {
  const double period_s = session.settings.period_s;
  std::array<char, 32> found{};
  std::snprintf(found.data(), found.size(), "%.9g ms", 1e3 * period_s);
  const auto refuse = [&](const char* expected, const char* advice) {
    description::SetupProblem problem = timestep_problem(session.cell, options);
    problem.found = found.data();
    problem.expected = expected;
    problem.advice = advice;
    throw description::SetupError(problem);
  };
  if (!(period_s >= shortest_period_s && period_s <= longest_period_s)) refuse("0.05 to 100 ms", "");
  const std::int64_t period_ns = std::llround(1e9 * period_s);
  if (period_ns % 1000 != 0 || !fieldbus::interpolation_period(period_ns)) {
    refuse("what drives can hold exactly: 1 to 255 times a power of ten of seconds (60C2h), in whole microseconds",
           "such as 0.5ms, 1ms, 1.5ms, 2ms, 4ms");
  }
}

void require_profile(const PreparedSession& session) {
  if (session.cell.profile != description::Profile::hand_guiding) return;
  if (!session.settings.without_enabling_input) return;
  throw description::SetupError({.key = "--without-enabling-input",
                                 .found = "a cell with profile: hand_guiding",
                                 .expected = "its enabling input: whoever leads the arm holds it"});
}

void require_inertia_in_range(const PreparedSession& session) {
  constexpr double most_kg_m2 = 1000.0;  // a tonne at a distance of a metre
  if (session.settings.orientation == OrientationMode::held) return;
  const double handle_kg_m2 = models::tool_inertia(session.cell.tool).largest_kg_m2, felt = felt_inertia_kg_m2(session);
  if (felt > handle_kg_m2 && felt <= most_kg_m2) return;
  const bool is_small = !(felt > handle_kg_m2);
  std::array<char, 80> expected{};
  std::snprintf(expected.data(), expected.size(),
                is_small ? "more than the handle's own %.3g kg m²" : "at most %.4g kg m²",
                is_small ? handle_kg_m2 : most_kg_m2);
  throw description::SetupError({.key = "--inertia",
                                 .found = description::number_text(felt) + " kg m²",
                                 .expected = expected.data(),
                                 .advice = is_small
                                               ? "the handle sits after the sensor, so no control can make it lighter"
                                               : "--orientation held keeps the tool from turning at all"});
}

void require_stable(const PreparedSession& session, const RunOptions& options) {
  if (session.impedance()) return require_stable_coupling(session);
  require_mass_in_range(session, options);
  if (options.force_unstable && !options.bus.simulated()) {
    throw description::SetupError({.key = "--force-unstable",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim: an unstable mass is for simulation only"});
  }
  try {
    // The mass is judged without lookahead, so that lookahead never makes a mass pass that is unstable without it.
    LoopModel loop = session.loop;
    loop.horizon_s = 0.0;
    require_stable_mass(session.settings.mass_kg, hand_model(session), loop, options.force_unstable);
  } catch (const description::SetupError& error) {
    if (options.mass_kg) throw;
    description::SetupProblem problem = error.problem();
    problem.file = session.cell.file.string();
    problem.key = "default_mass_kg";
    throw description::SetupError(problem);
  }
  if (!options.force_unstable) require_stable_horizon(session);
  if (session.settings.orientation == OrientationMode::held || session.cell.drives.size() < 6) return;
  require_inertia_in_range(session);
  if (options.force_unstable) return;
  const std::optional<PoseLoop> both = pose_loop_at_start(session);
  if (!both) return;
  const HandModel hand = turning_hand_model(session);
  const LoopModel alone = turning_loop(session);
  const double mass_kg = session.settings.mass_kg, inertia_kg_m2 = felt_inertia_kg_m2(session);
  const bool is_stable = spectral_radius(hand, alone, inertia_kg_m2 - alone.handle_mass_kg) < 1.0;
  if (is_stable && both->stable(mass_kg, inertia_kg_m2)) return;
  const std::optional<double> least_alone = smallest_stable_mass(hand, alone);
  if (!least_alone)
    // Throws, because no inertia is stable.
    require_stable_inertia(inertia_kg_m2, hand, alone, false);
  std::optional<double> smallest = both->smallest_inertia(mass_kg);
  if (smallest) smallest = std::max(*smallest, *least_alone + alone.handle_mass_kg);
  refuse_unstable_pose(mass_kg, inertia_kg_m2, smallest);
}

}  // namespace proxarm::controller
