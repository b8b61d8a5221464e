#include "controller/preparation/prepared_session.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/file_kind.hpp"
#include "controller/preparation/modbus_rates.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/identifiers.hpp"
#include "controller/session/reachable_scene.hpp"
#include "controller/setpoints/setpoint_envelope.hpp"
#include "models/arm/arm.hpp"
#include "models/base/setup_error.hpp"
#include "scenes/format/scene_file.hpp"
#include "scenes/format/tool_file.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

constexpr const char* default_cell = "models/cells/default.yaml";

fs::path beside(const fs::path& file, const std::string& relative) {
  return (file.parent_path() / relative).lexically_normal();
}

// Loads a file that the user may have named. If the file is of another kind, the error says so, instead of naming the
// first key that the loader doesn't know.
template <typename Load>
auto loaded(const fs::path& file, FileKind kind, const Load& load) {
  try {
    return load(file);
  } catch (const description::SetupError&) {
    require_kind(file, kind);
    throw;
  }
}

// Throws SetupError if `given` is missing. The error names the option, because users often give a number instead of a
// file.
void require_file(const fs::path& given, const char* option, const char* example) {
  std::error_code ignored;
  if (given.empty() || fs::exists(user_file(given), ignored)) return;
  throw description::SetupError({.key = option,
                                 .message = given.string() + ": no such file",
                                 .expected = std::string("a file, such as ") + example});
}

// Returns the file `given` on the command line, else the file `cells_own` that the cell names under `key`, else the
// shipped file `without`.
fs::path chosen(const fs::path& given, const description::Cell& cell, const char* key, const std::string& cells_own,
                const char* without) {
  if (!given.empty()) return user_file(given);
  if (cells_own.empty()) return shipped_file(without);
  const fs::path file = beside(cell.file, cells_own);
  description::require_default_file(cell, key, file);
  return file;
}

// Returns how many equal readings in a row are allowed; 0: equal readings aren't counted. A real sensor's samples
// always differ; those of a simulated sensor without noise may be equal. A sensor slower than the cycle is read several
// times per sample.
std::uint32_t repeats_allowed(const description::SensorPlacement& sensor, bool real, std::uint32_t samples,
                              double period_s) {
  if (!real && !(sensor.noise_N > 0.0)) return 0;
  const double reads = sensor.sample_rate_Hz > 0.0 ? 1.0 / (period_s * sensor.sample_rate_Hz) : 1.0;
  return samples * static_cast<std::uint32_t>(std::ceil(std::clamp(reads, 1.0, 1000.0)));
}

// Returns how many cycles in a row may pass without a sample. If a sensor sends less often than once a cycle, `samples`
// counts the sensor's periods instead of cycles.
std::uint32_t missed_samples_allowed(const description::SensorDescription& sensor, std::uint32_t samples,
                                     double period_s) {
  if (!sensor.described || !sensor.described->streams()) return samples;
  const double cycles = 1.0 / (period_s * sensor.described->rate_Hz);
  return samples * static_cast<std::uint32_t>(std::ceil(std::clamp(cycles, 1.0, 1000.0)));
}

// Sets T and all settings that are counted in cycles.
void set_timestep(PreparedSession& session, const RunOptions& options, double period_s) {
  SessionSettings& settings = session.settings;
  settings.period_s = session.loop.period_s = period_s;
  settings.max_repeated_samples =
      repeats_allowed(session.cell.sensor, !options.hardware.empty(), options.settings.max_repeated_samples, period_s);
  settings.max_missed_samples = missed_samples_allowed(session.sensor, options.settings.max_missed_samples, period_s);
  require_period(session, options);
}

// Sets the scheme. The impedance type has no proxy with a mass of its own, so for it the options of a proxy are
// refused.
void choose_scheme(PreparedSession& session, const RunOptions& options) {
  SessionSettings& settings = session.settings;
  const auto& drives = session.cell.drives;
  const bool torques = std::any_of(drives.begin(), drives.end(),
                                   [](const description::DriveDescription& drive) { return drive.mode == "cst"; });
  settings.scheme = options.scheme.value_or(torques ? Scheme::impedance : Scheme::admittance);
  require_scheme(session.cell, settings);
  const auto refuse = [](const char* key, const char* found, const char* expected) {
    throw description::SetupError({.key = key, .found = found, .expected = expected});
  };
  if (settings.scheme == Scheme::admittance) {
    if (options.stiffness_N_per_m) refuse("--stiffness", "the admittance type", "--scheme impedance");
    return;
  }
  if (options.mass_kg) refuse("--mass", "the impedance type", "none: the hand feels the device's own mass");
  if (settings.spring_N_per_m > 0.0) refuse("--spring", "the impedance type", "--scheme admittance");
  if (settings.order != 1) refuse("--order", "2 with the impedance type", "1");
  if (settings.orientation != OrientationMode::held) {
    refuse(options.inertia_kg_m2 ? "--inertia" : "--orientation",
           options.inertia_kg_m2 ? "the impedance type" : "free with the impedance type",
           "none: the tool's orientation isn't rendered");
  }
  settings.coupling_stiffness_N_per_m = options.stiffness_N_per_m.value_or(settings.coupling_stiffness_N_per_m);
  if (options.damping_Ns_per_m || settings.damping_Ns_per_m > 0.0) {
    settings.coupling_damping_Ns_per_m = settings.damping_Ns_per_m;
  }
  settings.damping_Ns_per_m = 0.0;
  settings.mass_kg = 0.0;
}

// Sets the orientation's mode. A held orientation means J → ∞, so the options for inertia, turning damping and turning
// spring are refused with it.
void choose_orientation(PreparedSession& session, const RunOptions& options) {
  SessionSettings& settings = session.settings;
  const char* const turns = options.inertia_kg_m2                 ? "--inertia"
                            : options.turning_damping_Nms_per_rad ? "--turning-damping"
                            : options.turning_spring_Nm_per_rad   ? "--turning-spring"
                                                                  : nullptr;
  settings.orientation = options.orientation.value_or(turns ? OrientationMode::free : OrientationMode::held);
  if (turns && settings.orientation == OrientationMode::held) {
    throw description::SetupError(
        {.key = turns, .found = "--orientation held", .expected = "--orientation free, or none of the two"});
  }
  settings.rotational_inertia_kg_m2 = options.inertia_kg_m2.value_or(settings.rotational_inertia_kg_m2);
  // With a requested inertia there is no default damping, as with a requested mass.
  if (options.inertia_kg_m2) settings.rotational_damping_Nms_per_rad = 0.0;
  settings.rotational_damping_Nms_per_rad =
      options.turning_damping_Nms_per_rad.value_or(settings.rotational_damping_Nms_per_rad);
  settings.rotational_spring_Nm_per_rad =
      options.turning_spring_Nm_per_rad.value_or(settings.rotational_spring_Nm_per_rad);
}

// Sets the tool to the one named on the command line, else to the scene's, else to the cell's.
void choose_tool(PreparedSession& session, const RunOptions& options) {
  const std::string& of_cell = session.cell.tool.shape;
  if (options.tool == "point") {
    session.scene.tool = nullptr;
  } else if (!options.tool.empty() || (!session.scene.tool && !of_cell.empty())) {
    const fs::path file = options.tool.empty() ? fs::path(of_cell) : user_file(options.tool);
    require_file(options.tool, "--tool", "scenes/tools/rod.yaml");
    session.scene.tool = std::make_shared<const scenes::RigidTool>(loaded(file, FileKind::tool, scenes::load_tool));
  }
}

void require_renderable_tool(PreparedSession& session) {
  if (!session.scene.tool) return;
  const auto refuse = [&](const char* key, const std::string& found, const char* expected) {
    throw description::SetupError({.key = key, .found = found + " with a rigid tool", .expected = expected});
  };
  if (session.impedance()) {
    refuse("--scheme", "the impedance type", "admittance, or --tool point: torques are rendered at a point alone");
  }
  if (session.settings.order != 1) {
    refuse("--order", "2", "1: order 2 needs the contacts of the step before, which a pose's aren't labelled with");
  }
  if (session.settings.looks_ahead && session.settings.orientation == OrientationMode::free) {
    refuse(
        "--lookahead", "--orientation free",
        "--lookahead off, or --orientation held: the place of a tool that pivots on a contact would be predicted, but "
        "not its turn");
  }
  const std::size_t axes = session.cell.drives.size();
  if (axes < 6) {
    refuse("--tool", std::to_string(axes) + " axes", "six axes or more: fewer can't hold an orientation");
  }
  session.rigid = scenes::compile_rigid(session.scene, session.scene.tool->shape);
}

void add_delay(description::SensorPlacement& sensor, double extra_delay_s) {
  sensor.delay_s += extra_delay_s;
  if (sensor.delay_s <= description::longest_sensor_delay_s) return;
  throw description::SetupError(
      {.key = "--extra-delay",
       .found = description::number_text(sensor.delay_s) + " s, with the cell's",
       .expected = "at most " + description::number_text(description::longest_sensor_delay_s) + " s"});
}

void choose_passivity(PreparedSession& session, const RunOptions& options) {
  const std::string& cells = session.cell.passivity;
  const Passivity otherwise = cells == "on"        ? Passivity::on
                              : cells == "auto"    ? Passivity::automatic
                              : cells == "observe" ? Passivity::observe
                                                   : Passivity::off;
  // In the impedance type there is no energy to observe: `automatic` and `observe` in the cell become `off`, and `on`
  // is refused.
  const bool nothing_to_see = session.impedance() && otherwise != Passivity::on;
  session.settings.passivity = options.passivity.value_or(nothing_to_see ? Passivity::off : otherwise);
  if (!session.impedance() || session.settings.passivity == Passivity::off) return;
  throw description::SetupError({.file = options.passivity ? "" : session.cell.file.string(),
                                 .key = options.passivity ? "--passivity" : "passivity",
                                 .found = "the impedance type",
                                 .expected = "off: it has no proxy with a mass to be damped"});
}

[[noreturn]] void refuse_lookahead() {
  throw description::SetupError({.key = "--lookahead",
                                 .found = "the impedance type",
                                 .expected = "off: its tool isn't sent anywhere, and follows the hand without delay"});
}

// Chooses the damping of the gears. The start pose is enough, as the gears are the same in every pose.
void choose_gear_damping(PreparedSession& session) {
  GearDampingChoice& chosen = session.loop.gear_damping;
  chosen = {};
  if (session.damps_gears) {
    chosen.joints = damped_joints(models::Arm(session.cell), session.cell.drives, session.settings.period_s);
    chosen.damping_per_s = best_gear_damping_per_s(hand_model(session), session.loop);
  }
  session.settings.gear_damping_per_s = chosen.damping_per_s;
  session.settings.damped_gears = chosen.joints;
}

}  // namespace

void choose_horizon(PreparedSession& session) {
  using Kind = LookaheadChoice::Kind;
  double horizon_s = session.lookahead.kind == Kind::fixed ? session.lookahead.horizon_s : 0.0;
  session.loop.horizon_s = 0.0;
  if (session.lookahead.kind == Kind::automatic) horizon_s = longest_horizon_s(session);
  session.settings.horizon_s = session.loop.horizon_s = horizon_s;
}

PreparedSession prepare(const RunOptions& options) {
  constexpr double week_s = 604800.0;
  if (!(options.duration_s <= week_s)) {
    throw description::SetupError({.key = "--duration",
                                   .found = description::number_text(options.duration_s) + " s",
                                   .expected = "at most a week"});
  }
  PreparedSession session;
  const fs::path cell_file = options.cell.empty() ? shipped_file(default_cell) : user_file(options.cell);
  require_file(options.scene, "--scene", "scenes/wall.yaml");
  require_file(options.hand, "--hand", "sim/hands/touch.yaml");
  session.cell = loaded(cell_file, FileKind::cell, description::load_cell);
  session.sensor =
      description::load_sensor(beside(session.cell.file, session.cell.sensor.description), session.cell.sensor.choices);
  require_own_identifiers(session.cell, session.sensor, options.settings, buses_in_order(session.cell));
  session.hand =
      loaded(chosen(options.hand, session.cell, "default_hand", session.cell.default_hand, "sim/hands/touch.yaml"),
             FileKind::hand, description::load_hand);
  session.scene =
      loaded(chosen(options.scene, session.cell, "default_scene", session.cell.default_scene, "scenes/free.yaml"),
             FileKind::scene, scenes::load_scene);
  session.scene = reachable_scene(std::move(session.scene), session.cell);
  session.clearances = std::make_shared<const scenes::Clearances>(session.scene);
  choose_tool(session, options);
  add_delay(session.cell.sensor, options.extra_delay_s);
  session.settings = options.settings;
  session.settings.mass_kg = options.mass_kg.value_or(session.cell.default_mass_kg);
  session.settings.damping_Ns_per_m = options.damping_Ns_per_m.value_or(session.cell.default_damping_Ns_per_m);
  session.settings.receive_window = session.cell.receive_window;
  session.duration_s = options.duration_s;
  session.settings.zero_S_N = description::simulated_zero_S_N(session.sensor);
  if (!std::isfinite(session.settings.zero_drift_N)) {
    const double of_cell_N = session.cell.sensor.zero_drift_N;
    session.settings.zero_drift_N = of_cell_N > 0.0 ? of_cell_N : description::zero_drift_N(session.sensor);
  }
  set_timestep(session, options, options.period_s.value_or(session.cell.default_period_s));
  choose_orientation(session, options);
  choose_scheme(session, options);
  choose_passivity(session, options);
  require_profile(session);

  session.loop.delay_s = loop_delay_s(session);
  session.lookahead = options.lookahead.value_or(LookaheadChoice{});
  if (session.impedance()) {
    if (options.lookahead && session.lookahead.kind != LookaheadChoice::Kind::off) refuse_lookahead();
    session.lookahead = {};
    require_renderable_tool(session);
    return session;
  }
  session.loop.drive_time_constant_s = slowest_drive_lag_s(session.cell.drives);
  session.loop.handle_mass_kg = session.cell.tool.mass_kg;
  session.loop.damping_Ns_per_m = session.settings.damping_Ns_per_m;
  session.loop.spring_N_per_m = session.settings.spring_N_per_m;
  session.loop.order = session.settings.order;
  session.loop.arms = arms_at_start(session);
  session.loop.layers = layers_of(session.scene);
  session.settings.force_age_s = session.cell.sensor.delay_s;
  session.settings.report_rate_Hz = slowest_report_Hz(session.cell);
  session.settings.looks_ahead = session.lookahead.kind != LookaheadChoice::Kind::off;
  require_renderable_tool(session);
  session.damps_gears = options.damps_gears;
  choose_gear_damping(session);
  choose_horizon(session);
  return session;
}

PreparedSession with_timestep(PreparedSession session, const RunOptions& options, double period_s) {
  set_timestep(session, options, period_s);
  session.loop.delay_s = loop_delay_s(session);
  if (!session.impedance()) choose_horizon(session);
  return session;
}

PreparedSession with_gear_torques(PreparedSession session, const description::GearTorque& torque) {
  for (description::DriveDescription& drive : session.cell.drives) {
    if (drive.gear_stiffness_Nm_per_rad > 0.0) drive.gear_torque = torque;
  }
  session.loop.arms = arms_at_start(session);
  choose_gear_damping(session);
  choose_horizon(session);
  return session;
}

PreparedSession with_tool(PreparedSession session, double mass_kg, const std::array<double, 3>& centre_S_m) {
  const bool turns = session.settings.orientation == OrientationMode::free;
  if (session.scene.tool && turns) session.settings.rotational_inertia_kg_m2 = felt_inertia_kg_m2(session);
  session.cell.tool.mass_kg = mass_kg;
  session.cell.tool.centre_of_mass_S_m = centre_S_m;
  session.loop.handle_mass_kg = mass_kg;
  session.loop.arms = arms_at_start(session);
  choose_horizon(session);
  return session;
}

}  // namespace proxarm::controller
