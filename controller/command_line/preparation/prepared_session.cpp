#include "controller/command_line/preparation/prepared_session.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "controller/command_line/preparation/cell_buses.hpp"
#include "controller/command_line/preparation/data_files.hpp"
#include "controller/command_line/preparation/file_kind.hpp"
#include "controller/command_line/preparation/modbus_rates.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/identifiers.hpp"
#include "controller/session/reachable_scene.hpp"
#include "controller/setpoints/setpoint_envelope.hpp"
#include "fieldbus/cia402/cia402_units.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/key_line.hpp"
#include "models/rigid_shapes/furthest.hpp"
#include "scenes/compiler/layer_touches.hpp"
#include "scenes/format/scene_file.hpp"
#include "scenes/format/tool_file.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using std::numbers::pi;

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

// Returns the mean age of a sample in s. The converter holds a sample for half the sampling period on average, and the
// filter adds its time constant.
double sensor_delay_s(const description::SensorPlacement& sensor) {
  double delay_s = sensor.delay_s;
  if (sensor.sample_rate_Hz > 0.0) delay_s += 0.5 / sensor.sample_rate_Hz;
  if (sensor.bandwidth_Hz > 0.0) delay_s += 1.0 / (2.0 * pi * sensor.bandwidth_Hz);
  return delay_s;
}

// Returns the delay of ElasticSetpoint's critically damped filter, 2/ω, in s.
double setpoint_filter_delay_s(const description::Cell& cell) {
  return cell.limits.setpoint_bandwidth_Hz > 0.0 ? 2.0 / (2.0 * pi * cell.limits.setpoint_bandwidth_Hz) : 0.0;
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

// Returns the mean delay, in s, that a streaming sensor adds because it isn't synchronous with the cycle.
double stream_delay_s(const description::SensorDescription& sensor) {
  return sensor.described && sensor.described->streams() ? 0.5 / sensor.described->rate_Hz : 0.0;
}

// With a shorter period no computer keeps the cycle; with a longer one a contact no longer feels like touch.
constexpr double shortest_period_s = 50e-6, longest_period_s = 0.1;

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

// Sets T and all settings that are counted in cycles.
void set_timestep(PreparedSession& session, const RunOptions& options, double period_s) {
  controller::SessionSettings& settings = session.settings;
  settings.period_s = session.loop.period_s = period_s;
  settings.max_repeated_samples =
      repeats_allowed(session.cell.sensor, !options.hardware.empty(), options.settings.max_repeated_samples, period_s);
  settings.max_missed_samples = missed_samples_allowed(session.sensor, options.settings.max_missed_samples, period_s);
  require_period(session, options);
}

// Returns the loop's delay beyond the one period that every sampled loop has. A position setpoint is reached one period
// after it is latched. A torque is held for a period, which delays it by half a period on average.
double loop_delay_s(const PreparedSession& session) {
  if (session.impedance()) return 0.5 * session.settings.period_s;
  return session.settings.period_s + sensor_delay_s(session.cell.sensor) + stream_delay_s(session.sensor) +
         setpoint_filter_delay_s(session.cell);
}

// Sets the scheme. The impedance type has no proxy with a mass of its own, so for it the options of a proxy are
// refused.
void choose_scheme(PreparedSession& session, const RunOptions& options) {
  using controller::Scheme;
  controller::SessionSettings& settings = session.settings;
  const auto& drives = session.cell.drives;
  const bool torques = std::any_of(drives.begin(), drives.end(),
                                   [](const description::DriveDescription& drive) { return drive.mode == "cst"; });
  settings.scheme = options.scheme.value_or(torques ? Scheme::impedance : Scheme::admittance);
  controller::require_scheme(session.cell, settings);
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
  if (settings.orientation != controller::OrientationMode::held) {
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
  using controller::OrientationMode;
  controller::SessionSettings& settings = session.settings;
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
  if (session.settings.looks_ahead) refuse("--lookahead", "a lookahead", "off: only a point's way is predicted");
  const std::size_t axes = session.cell.drives.size();
  if (axes < 6) {
    refuse("--tool", std::to_string(axes) + " axes", "six axes or more: fewer can't hold an orientation");
  }
  session.rigid = scenes::compile_rigid(session.scene, session.scene.tool->shape);
}

// Throws SetupError unless the virtual coupling's K and B at a wall are stable without a hand, in the device's lightest
// and heaviest direction.
void require_stable_coupling(const PreparedSession& session) {
  const controller::SessionSettings& settings = session.settings;
  const models::Arm arm(session.cell);
  const models::TipMass tip = arm.effective_mass_range(arm.start_rad(), models::tool_space(arm).dimensions);
  controller::ImpedanceConfig config{.stiffness_N_per_m = settings.coupling_stiffness_N_per_m,
                                     .damping_Ns_per_m = settings.coupling_damping_Ns_per_m,
                                     .period_s = settings.period_s};
  config.validate();
  for (const double mass_kg : {tip.min_kg, tip.max_kg}) {
    if (controller::coupling_spectral_radius(config, mass_kg) < 1.0) continue;
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

void add_delay(description::SensorPlacement& sensor, double extra_delay_s) {
  sensor.delay_s += extra_delay_s;
  if (sensor.delay_s <= description::longest_sensor_delay_s) return;
  throw description::SetupError(
      {.key = "--extra-delay",
       .found = description::number_text(sensor.delay_s) + " s, with the cell's",
       .expected = "at most " + description::number_text(description::longest_sensor_delay_s) + " s"});
}

void choose_passivity(PreparedSession& session, const RunOptions& options) {
  using controller::Passivity;
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

// Throws SetupError if an option removes what the cell's profile requires. The loader has already checked the cell
// itself.
void require_profile(const PreparedSession& session) {
  if (session.cell.profile != description::Profile::hand_guiding) return;
  if (!session.settings.without_enabling_input) return;
  throw description::SetupError({.key = "--without-enabling-input",
                                 .found = "a cell with profile: hand_guiding",
                                 .expected = "its enabling input: whoever leads the arm holds it"});
}

std::shared_ptr<const std::vector<controller::ElasticArm>> arms_at(const PreparedSession& session,
                                                                   const std::vector<models::JointVector>& poses_rad) {
  const models::Arm arm(session.cell);
  auto arms = std::make_shared<std::vector<controller::ElasticArm>>();
  for (const models::JointVector& pose_rad : poses_rad) {
    arms->push_back(controller::elastic_arm(arm, pose_rad, session.cell));
  }
  return arms;
}

// Returns the stiffness as text, for example "20 kN/m". Three digits are enough, because scenes have round numbers.
std::string stiffness_text(double N_per_m) {
  std::array<char, 40> text{};
  const bool kilo = N_per_m >= 1000.0;
  std::snprintf(text.data(), text.size(), kilo ? "%.3g kN/m" : "%.3g N/m", kilo ? 1e-3 * N_per_m : N_per_m);
  return text.data();
}

// Returns the layers as text, for example "layer 'foam' of 20 kN/m and layer 'mat' of 4 kN/m at once".
std::string words_of(const scenes::LayersTogether& layers) {
  std::string words;
  for (const scenes::PressedLayer& layer : layers) {
    words +=
        (words.empty() ? "layer '" : " and layer '") + layer.object + "' of " + stiffness_text(layer.stiffness_N_per_m);
  }
  return words + (layers.size() > 1 ? " at once" : "");
}

// Returns the ways in which the tool may touch the scene's layers: it slides on each combination of layers, and on a
// single layer with friction it may also stick. Returns null if the scene has no layers.
std::shared_ptr<const std::vector<controller::LayerTouch>> layers_of(const scenes::Scene& scene) {
  auto all = std::make_shared<std::vector<controller::LayerTouch>>();
  for (const scenes::LayersTogether& layers : scenes::layer_touches(scene)) {
    controller::LayerTouch touch{.what = words_of(layers)};
    for (const scenes::PressedLayer& layer : layers)
      touch.spring_W += layer.stiffness_N_per_m * layer.normal_W * layer.normal_W.transpose();
    all->push_back(touch);
    if (layers.size() > 1 || !(layers[0].friction > 0.0)) continue;
    touch.sticks_along_W = layers[0].normal_W;
    all->push_back(touch);
  }
  return all->empty() ? nullptr : all;
}

}  // namespace

controller::HandModel turning_hand_model(const PreparedSession& session) {
  const double tightest = 1.0 + session.hand.variation.share;
  return {tightest * session.hand.turning_stiffness_Nm_per_rad, tightest * session.hand.turning_damping_Nms_per_rad,
          session.hand.inertia_kg_m2};
}

double felt_inertia_kg_m2(const PreparedSession& session) {
  return controller::felt_inertia_kg_m2(session.cell, session.settings);
}

controller::LoopModel turning_loop(const PreparedSession& session) {
  const models::Arm arm(session.cell);
  controller::LoopModel loop = session.loop;
  loop.horizon_s = 0.0;  // the lookahead predicts the translation only
  loop.order = 1;
  loop.layers = nullptr;  // with a held place, layers have no effect
  // This loop holds the tool's place. With feed-forward in it, the inertia needed would come out a quarter too large;
  // PoseLoop judges the feed-forward.
  loop.either_drive = false;
  loop.handle_mass_kg = models::tool_inertia(session.cell.tool).largest_kg_m2;
  loop.damping_Ns_per_m = session.settings.rotational_damping_Nms_per_rad;
  loop.spring_N_per_m = session.settings.rotational_spring_Nm_per_rad;
  loop.arms = std::make_shared<const std::vector<controller::ElasticArm>>(
      1, controller::elastic_turning_arm(arm, arm.start_rad(), session.cell, session.hand.mass_kg));
  return loop;
}

namespace {
// Returns whether the hand turns the tool. If the hand doesn't twist the handle, rotation has no loop with the hand,
// and the proxy's pole at 1 would count as unstable.
bool is_turned(const PreparedSession& session) {
  return !session.impedance() && session.settings.orientation != controller::OrientationMode::held &&
         session.cell.drives.size() >= 6 && session.hand.twists();
}

// Returns the points at which contact is assumed. For a tool with a shape these are the extreme points in the
// directions of a cube's faces and corners. A point tool touches at T's origin.
std::vector<controller::TouchedPlace> touched_places_T(const PreparedSession& session) {
  std::vector<controller::TouchedPlace> places;
  const bool is_point = !session.scene.tool;
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1;
    const models::Vec3 way(x, y, z);
    if (way.squaredNorm() != 1.0 && way.squaredNorm() != 3.0) continue;
    if (is_point && i > 13) continue;  // the opposite direction gives the same constraint
    const models::Vec3 n_T = way.normalized();
    const models::Vec3 r_T = is_point ? models::Vec3::Zero() : models::furthest_of(session.scene.tool->shape, n_T);
    places.push_back({r_T, n_T});
  }
  return places;
}
}  // namespace

std::optional<controller::PoseLoopModel> turned_model(const PreparedSession& session) {
  if (!is_turned(session)) return {};
  controller::PoseLoopModel model;
  model.place = hand_model(session);
  model.turning = turning_hand_model(session);
  model.turning_damping_Nms_per_rad = session.settings.rotational_damping_Nms_per_rad;
  model.turning_spring_Nm_per_rad = session.settings.rotational_spring_Nm_per_rad;
  model.loop = session.loop;
  model.touched = touched_places_T(session);
  return model;
}

namespace {
std::optional<controller::PoseLoop> pose_loop_at_start(const PreparedSession& session) {
  const std::optional<controller::PoseLoopModel> model = turned_model(session);
  if (!model) return {};
  const models::Arm arm(session.cell);
  return controller::pose_loop_at(arm, arm.start_rad(), session.cell, *model);
}
}  // namespace

std::optional<controller::Swing> slowest_swing(const PreparedSession& session) {
  const std::optional<controller::PoseLoop> loop = pose_loop_at_start(session);
  if (!loop) return {};
  return loop->slowest_swing(session.settings.mass_kg, felt_inertia_kg_m2(session));
}

description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options) {
  if (options.period_s) return {.key = "--timestep"};
  return {.file = cell.file.string(),
          .line = description::line_of_key(cell.file, "default_period_s"),
          .key = "default_period_s"};
}

// The loosest grip that is judged; it replaces looser ones. A hand without stiffness, such as one that plays a recorded
// force, lets the tool drift: the loop has an eigenvalue of exactly 1 at any mass, which isn't an instability. With the
// loosest grip the drift decays. A kilogram on this grip swings with a period of six seconds, far slower than any
// oscillation of interest. With this grip D > K L for any loop delay L below a second; with D < K L no mass would be
// stable.
constexpr double loosest_N_per_m = 1.0, loosest_Ns_per_m = 1.0;

namespace {
controller::HandModel held_with(const description::Grip& grip, double mass_kg) {
  if (grip.stiffness_N_per_m >= loosest_N_per_m) return {grip.stiffness_N_per_m, grip.damping_Ns_per_m, mass_kg};
  return {loosest_N_per_m, std::max(grip.damping_Ns_per_m, loosest_Ns_per_m), mass_kg};
}

// Returns each of the hand's grips other than the tightest one, at its largest stiffness and damping, without
// duplicates. A grip with hardly any stiffness and damping is left out, because the hand has let go.
std::vector<description::Grip> other_grips(const description::HandDescription& hand,
                                           const description::Grip& tightest) {
  std::vector<description::Grip> all{{0.0, hand.stiffness_N_per_m, hand.damping_Ns_per_m}}, others;
  all.insert(all.end(), hand.grips.begin(), hand.grips.end());
  for (description::Grip grip : all) {
    grip.stiffness_N_per_m *= 1.0 + hand.variation.share;
    grip.damping_Ns_per_m *= 1.0 + hand.variation.share;
    const auto same = [&](const description::Grip& other) {
      return other.stiffness_N_per_m == grip.stiffness_N_per_m && other.damping_Ns_per_m == grip.damping_Ns_per_m;
    };
    const bool holds = grip.stiffness_N_per_m >= loosest_N_per_m || grip.damping_Ns_per_m >= loosest_Ns_per_m;
    if (holds && !same(tightest) && std::none_of(others.begin(), others.end(), same)) others.push_back(grip);
  }
  return others;
}
}  // namespace

// To save time, a grip's smallest stable mass is computed only if the largest of the earlier grips' smallest stable
// masses is unstable with this grip.
controller::HandModel hand_model(const PreparedSession& session, controller::LoopModel loop) {
  const description::Grip tightest = description::tightest_grip(session.hand);
  controller::HandModel worst = held_with(tightest, session.hand.mass_kg);
  const std::vector<description::Grip> others = other_grips(session.hand, tightest);
  if (session.impedance() || others.empty()) return worst;
  loop.horizon_s = 0.0;
  std::optional<double> least_kg = controller::smallest_stable_mass(worst, loop);
  for (const description::Grip& grip : others) {
    const controller::HandModel hand = held_with(grip, session.hand.mass_kg);
    if (!least_kg) return worst;
    if (controller::spectral_radius(hand, loop, *least_kg) < 1.0) continue;
    least_kg = controller::smallest_stable_mass(hand, loop);
    worst = hand;
  }
  return worst;
}

controller::HandModel hand_model(const PreparedSession& session) { return hand_model(session, session.loop); }

std::vector<models::JointVector> led_poses(const PreparedSession& session) {
  std::vector<controller::Lead> leads;
  for (const description::Waypoint& waypoint : session.hand.waypoints) {
    leads.push_back({.offset_m = models::Vec3(waypoint.offset_m.data())});
    if (is_turned(session)) leads.back().turn_rad = models::Vec3(waypoint.turn_rad.data());
  }
  // Adds the poses at both ends of each sine, and at both ends of the sum of all sines.
  controller::Lead all;
  const auto add_both = [&](const controller::Lead& lead) {
    leads.push_back(lead);
    leads.push_back({-lead.offset_m, -lead.turn_rad});
  };
  for (const description::Sine& sine : session.hand.multisine) {
    const models::Vec3 direction(sine.direction.data());
    const controller::Lead end{sine.amplitude_m * direction,
                               (is_turned(session) ? sine.amplitude_rad : 0.0) * direction};
    all = {all.offset_m + end.offset_m, all.turn_rad + end.turn_rad};
    add_both(end);
  }
  if (session.hand.multisine.size() > 1) add_both(all);
  // Adds the poses at about 48 rows of a trajectory; more would take too much time.
  constexpr std::size_t places = 48;
  const std::vector<description::TimedVector>& trajectory = session.hand.trajectory;
  const std::size_t step = std::max<std::size_t>(1, trajectory.size() / places);
  for (std::size_t i = 0; i < trajectory.size(); i += step) {
    leads.push_back({.offset_m = models::Vec3(trajectory[i].value.data())});
  }
  return controller::led_poses(models::Arm(session.cell), leads);
}

controller::LoopModel led_loop(const PreparedSession& session) {
  controller::LoopModel loop = session.loop;
  loop.arms = arms_at(session, led_poses(session));
  return loop;
}

double longest_horizon_s(const PreparedSession& session) {
  const double proxy_kg = session.settings.mass_kg - session.loop.handle_mass_kg;
  controller::LoopModel loop = led_loop(session);
  loop.filter_s = 0.5 * setpoint_filter_delay_s(session.cell);
  return controller::stable_horizon_s(hand_model(session), loop, proxy_kg);
}

namespace {
// Chooses the damping of the gears. The start pose is enough, as the gears are the same in every pose.
void choose_gear_damping(PreparedSession& session) {
  controller::GearDampingChoice& chosen = session.loop.gear_damping;
  chosen = {};
  if (session.damps_gears) {
    chosen.joints =
        controller::damped_joints(models::Arm(session.cell), session.cell.drives, session.settings.period_s);
    chosen.damping_per_s = controller::best_gear_damping_per_s(hand_model(session), session.loop);
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
  controller::require_own_identifiers(session.cell, session.sensor, options.settings, buses_in_order(session.cell));
  session.hand =
      loaded(chosen(options.hand, session.cell, "default_hand", session.cell.default_hand, "sim/hands/touch.yaml"),
             FileKind::hand, description::load_hand);
  session.scene =
      loaded(chosen(options.scene, session.cell, "default_scene", session.cell.default_scene, "scenes/free.yaml"),
             FileKind::scene, scenes::load_scene);
  session.scene = controller::reachable_scene(std::move(session.scene), session.cell);
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
  session.loop.drive_time_constant_s = controller::slowest_drive_lag_s(session.cell.drives);
  session.loop.handle_mass_kg = session.cell.tool.mass_kg;
  session.loop.damping_Ns_per_m = session.settings.damping_Ns_per_m;
  session.loop.spring_N_per_m = session.settings.spring_N_per_m;
  session.loop.order = session.settings.order;
  session.loop.arms = arms_at(session, controller::led_poses(models::Arm(session.cell), {}));
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
  session.loop.arms = arms_at(session, controller::led_poses(models::Arm(session.cell), {}));
  choose_gear_damping(session);
  choose_horizon(session);
  return session;
}

PreparedSession with_tool(PreparedSession session, double mass_kg, const std::array<double, 3>& centre_S_m) {
  const bool turns = session.settings.orientation == controller::OrientationMode::free;
  if (session.scene.tool && turns) session.settings.rotational_inertia_kg_m2 = felt_inertia_kg_m2(session);
  session.cell.tool.mass_kg = mass_kg;
  session.cell.tool.centre_of_mass_S_m = centre_S_m;
  session.loop.handle_mass_kg = mass_kg;
  session.loop.arms = arms_at(session, controller::led_poses(models::Arm(session.cell), {}));
  choose_horizon(session);
  return session;
}

namespace {
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

}  // namespace

void require_inertia_in_range(const PreparedSession& session) {
  constexpr double most_kg_m2 = 1000.0;  // a tonne at a distance of a metre
  if (session.settings.orientation == controller::OrientationMode::held) return;
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
    controller::LoopModel loop = session.loop;
    loop.horizon_s = 0.0;
    controller::require_stable_mass(session.settings.mass_kg, hand_model(session), loop, options.force_unstable);
  } catch (const description::SetupError& error) {
    if (options.mass_kg) throw;
    description::SetupProblem problem = error.problem();
    problem.file = session.cell.file.string();
    problem.key = "default_mass_kg";
    throw description::SetupError(problem);
  }
  if (!options.force_unstable) require_stable_horizon(session);
  if (session.settings.orientation == controller::OrientationMode::held || session.cell.drives.size() < 6) return;
  require_inertia_in_range(session);
  if (options.force_unstable) return;
  const std::optional<controller::PoseLoop> both = pose_loop_at_start(session);
  if (!both) return;
  const controller::HandModel hand = turning_hand_model(session);
  const controller::LoopModel alone = turning_loop(session);
  const double mass_kg = session.settings.mass_kg, inertia_kg_m2 = felt_inertia_kg_m2(session);
  const bool is_stable = controller::spectral_radius(hand, alone, inertia_kg_m2 - alone.handle_mass_kg) < 1.0;
  if (is_stable && both->stable(mass_kg, inertia_kg_m2)) return;
  const std::optional<double> least_alone = controller::smallest_stable_mass(hand, alone);
  if (!least_alone)
    // Throws, because no inertia is stable.
    controller::require_stable_inertia(inertia_kg_m2, hand, alone, false);
  std::optional<double> smallest = both->smallest_inertia(mass_kg);
  if (smallest) smallest = std::max(*smallest, *least_alone + alone.handle_mass_kg);
  controller::refuse_unstable_pose(mass_kg, inertia_kg_m2, smallest);
}

double motion_delay_s(const PreparedSession& session) {
  if (session.impedance()) return 0.0;
  return 2.0 * session.settings.period_s + setpoint_filter_delay_s(session.cell);
}

double total_delay_s(const PreparedSession& session) {
  return session.loop.period_s + session.loop.delay_s + session.loop.drive_time_constant_s;
}

}  // namespace proxarm::command_line
