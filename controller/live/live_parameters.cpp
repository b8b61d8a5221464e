#include "controller/live/live_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <sstream>
#include <utility>

#include "controller/live/orders.hpp"
#include "controller/live/session_status.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/session/bring_up.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

struct Live {
  const char* name;
  Parameter parameter;
  double (*parse)(std::string_view text, std::string_view option);
};

// Returns whether the text is a change of the lookahead, such as "lookahead=8ms" or "lookahead=auto".
bool is_lookahead(const std::string& text) { return text.compare(0, 10, "lookahead=") == 0; }

bool is_tool(const std::string& text) {
  return text.compare(0, 10, "tool_mass=") == 0 || text.compare(0, 14, "tool_centre_m=") == 0;
}

constexpr Live live[] = {{"mass", Parameter::mass, description::parse_mass},
                         {"damping", Parameter::damping, description::parse_damping},
                         {"spring", Parameter::spring, description::parse_stiffness},
                         {"inertia", Parameter::inertia, description::parse_inertia},
                         {"turning_damping", Parameter::turning_damping, description::parse_turning_damping},
                         {"turning_spring", Parameter::turning_spring, description::parse_turning_stiffness}};

bool turns(Parameter parameter) {
  return parameter == Parameter::inertia || parameter == Parameter::turning_damping ||
         parameter == Parameter::turning_spring;
}

const Live& find(const std::string& text) {
  const std::string name = text.substr(0, text.find('='));
  std::vector<std::string> known;
  for (const Live& parameter : live) {
    if (name == parameter.name && text.find('=') != std::string::npos) return parameter;
    known.emplace_back(parameter.name);
  }
  throw SetupError({.key = "--set",
                    .found = description::in_quotes(text),
                    .expected = "NAME=VALUE with NAME " + description::one_of(known) +
                                ", tool_mass, tool_centre_m, lookahead, timestep, OBJECT.friction, OBJECT.position_m"});
}

[[noreturn]] void refuse(const std::string& key, const std::string& found, const std::string& expected,
                         const std::string& advice = "") {
  throw SetupError({.key = key, .found = found, .expected = expected, .advice = advice});
}

double number_of(const std::string& text, const std::string& key, const std::string& expected, double least,
                 double most) {
  const std::optional<double> value = description::strict_number(text);
  if (!value || !(*value >= least && *value <= most)) refuse(key, description::in_quotes(text), expected);
  return *value;
}

// Parses "X,Y,Z". Throws SetupError if a number's size is above `most`.
std::array<double, 3> three_numbers(const std::string& text, const std::string& key, const std::string& expected,
                                    double most) {
  std::array<double, 3> numbers{};
  std::istringstream parts(text + ",");
  for (double& x : numbers) {
    std::string part;
    std::getline(parts, part, ',');
    x = number_of(part, key, expected, -most, most);
  }
  if (parts.peek() != std::istringstream::traits_type::eof())
    refuse(key, description::in_quotes(text), "three numbers");
  return numbers;
}

constexpr double most_friction = 10.0;
constexpr double farthest_m = 10.0, farthest_centre_m = 1.0;

// Parses "NAME.friction=MU" and "NAME.position_m=X,Y,Z"; nullopt for other keys.
std::optional<Change> change_of_object(const std::string& text, const scenes::Scene& scene) {
  const std::size_t equals = text.find('='), dot = text.rfind('.', equals);
  if (equals == std::string::npos || dot == std::string::npos) return {};
  const std::string name = text.substr(0, dot), what = text.substr(dot + 1, equals - dot - 1);
  const std::string key = text.substr(0, equals), value = text.substr(equals + 1);
  if (what != "friction" && what != "position_m") refuse(key, description::in_quotes(what), "friction or position_m");
  const auto object =
      std::find_if(scene.objects.begin(), scene.objects.end(), [&](const scenes::Object& o) { return o.name == name; });
  if (object == scene.objects.end()) {
    std::vector<std::string> names;
    for (const scenes::Object& o : scene.objects) names.push_back(o.name);
    refuse(
        key, description::in_quotes(name),
        names.empty() ? "an object, and this scene has none" : "an object of the scene: " + description::one_of(names));
  }
  Change change;
  change.object = static_cast<std::int32_t>(object - scene.objects.begin());
  if (what == "friction") {
    change.parameter = Parameter::friction;
    change.value = number_of(value, key, "a friction coefficient from 0 to 10", 0.0, most_friction);
    if (scene.tool || scenes::compile(scene).has_friction(static_cast<std::size_t>(change.object))) return change;
    refuse(key, "a single wall without friction, which is compiled without, or friction by region",
           "an object whose friction can change", "give it some in the scene file, such as friction: 0.001");
  }
  change.parameter = Parameter::position;
  if (!object->motion || !object->motion->driven) {
    refuse(key, "an object that stands still", "an object that is driven",
           "give it motion: {driven: true} in the scene file");
  }
  change.position_m =
      three_numbers(value, key, "three numbers X,Y,Z, metres from where it is described, at most 10", farthest_m);
  return change;
}

fs::path control_path(const RunOptions& options) {
  return options.control == "default" ? default_control_path() : options.control;
}

}  // namespace

LiveParameters::LiveParameters(const PreparedSession& session, const RunOptions& options)
    : session_(session), options_(options) {}

void LiveParameters::follow(double period_s) {
  if (period_s != session_.settings.period_s) session_ = with_timestep(session_, named(period_s), period_s);
}

// Returns the options with the session's present mass, so that an error message names that mass.
RunOptions LiveParameters::named(double period_s) const {
  RunOptions judged = options_;
  judged.mass_kg = session_.settings.mass_kg;
  judged.period_s = period_s;
  return judged;
}

Timestep LiveParameters::take_timestep(const std::string& text) {
  const double period_s = description::parse_duration(text.substr(text.find('=') + 1), "timestep");
  if (!session_.cell.modbus_lines.empty()) {
    refuse("timestep", "a cell with a Modbus line", "drives and sensor on CAN: what is on a line keeps its timestep",
           "start a new session with --timestep");
  }
  const RunOptions judged = named(period_s);
  PreparedSession changed = with_timestep(session_, judged, period_s);
  require_timestep(changed.cell, changed.settings);
  require_stable(changed, judged);
  require_carried(changed, judged);
  session_ = std::move(changed);
  const SessionSettings& settings = session_.settings;
  return {settings.period_s, settings.max_missed_samples, settings.max_repeated_samples, settings.horizon_s};
}

bool LiveParameters::is_timestep(const std::string& text) { return text.compare(0, 9, "timestep=") == 0; }

Change LiveParameters::take(const std::string& text) {
  if (const std::optional<Change> change = change_of_object(text, session_.scene)) return *change;
  if (is_lookahead(text)) return take_lookahead(text);
  if (is_tool(text)) return take_tool(text);
  const Live& parameter = find(text);
  const double value = parameter.parse(text.substr(text.find('=') + 1), parameter.name);
  if (turns(parameter.parameter) && session_.settings.orientation == OrientationMode::held) {
    refuse(parameter.name, "a session whose tool keeps its orientation", "one that was started with --orientation free",
           "start a new session with --inertia or --orientation free");
  }
  PreparedSession changed = session_;
  switch (parameter.parameter) {
    case Parameter::mass:
      changed.settings.mass_kg = value;
      break;
    case Parameter::damping:
      changed.settings.damping_Ns_per_m = changed.loop.damping_Ns_per_m = value;
      break;
    case Parameter::spring:
      changed.settings.spring_N_per_m = changed.loop.spring_N_per_m = value;
      break;
    case Parameter::inertia:
      changed.settings.rotational_inertia_kg_m2 = value;
      break;
    case Parameter::turning_damping:
      changed.settings.rotational_damping_Nms_per_rad = value;
      break;
    case Parameter::turning_spring:
      changed.settings.rotational_spring_Nm_per_rad = value;
      break;
    case Parameter::friction:
    case Parameter::position:
    case Parameter::lookahead:
    case Parameter::tool:
    case Parameter::none:
      break;
  }
  choose_horizon(changed);
  RunOptions judged = options_;
  judged.mass_kg = changed.settings.mass_kg;  // so that an error message names this mass
  require_stable(changed, judged);
  session_ = std::move(changed);
  const double handle_kg = parameter.parameter == Parameter::mass ? session_.cell.tool.mass_kg : 0.0;
  return {.parameter = parameter.parameter,
          .value = value - handle_kg,
          .period_s = session_.settings.period_s,
          .horizon_s = session_.settings.horizon_s,
          .tool_mass_kg = handle_kg};
}

Change LiveParameters::take_tool(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string key = text.substr(0, equals), value = text.substr(equals + 1);
  const description::ToolDescription& tool = session_.cell.tool;
  const double mass_kg = key == "tool_mass" ? description::parse_mass(value, key) : tool.mass_kg;
  const std::array<double, 3> centre_S_m =
      key == "tool_mass" ? tool.centre_of_mass_S_m
                         : three_numbers(value, key, "three numbers X,Y,Z, metres in S, at most 1", farthest_centre_m);
  const double felt_kg = session_.settings.mass_kg;
  if (!(mass_kg < felt_kg)) {
    refuse(key, description::number_text(mass_kg) + " kg",
           "less than the felt mass of " + description::number_text(felt_kg) + " kg",
           "the tool behind the sensor is felt in full; set mass= to more first");
  }
  PreparedSession changed = with_tool(session_, mass_kg, centre_S_m);
  RunOptions judged = options_;
  judged.mass_kg = felt_kg;
  require_stable(changed, judged);
  if (changed.scene.tool) require_felt(changed.cell, changed.settings);
  session_ = std::move(changed);
  return {.parameter = Parameter::tool,
          .value = felt_kg - mass_kg,
          .position_m = centre_S_m,
          .period_s = session_.settings.period_s,
          .horizon_s = session_.settings.horizon_s,
          .tool_mass_kg = mass_kg};
}

void LiveParameters::require_tool(const LiveParameters& before, const ToolEvidence& seen) const {
  using Why = ToolDoubt::Why;
  const HeldTool from = held_tool(before.session_.cell.tool);
  const HeldTool to = held_tool(session_.cell.tool);
  const ToolDoubt doubt = seen.doubt(from, to);
  if (doubt.why == Why::none) return;
  const std::string key = from.mass_kg != to.mass_kg ? "tool_mass" : "tool_centre_m";
  const auto text = [](double value) { return description::rounded_text(value); };
  const std::string unit = doubt.why == Why::torque ? " Nm" : " N";
  if (doubt.why == Why::zero) {
    refuse(key, "a zero of the sensor that would be " + text(doubt.would_be) + " N off the one that is remembered",
           "at most " + text(doubt.limit) + " N, by which it drifts",
           "these figures are for the tool that hung there when the sensor was tared: after a change of the tool, "
           "start a new session, or take the zero anew: proxarm zero");
  }
  refuse(
      key,
      "a sensor that would read " + text(doubt.would_be) + unit + " beside this tool, and reads " +
          text((doubt.why == Why::torque ? seen.hand_S.torque : seen.hand_S.force).norm()) + unit + " now",
      "at most " + text(doubt.limit) + unit + ": with nobody at the handle the arm would be led off",
      "if they are right, let the sensor show it: hold the arm (proxarm hold) and take the hand off, turn the tool to "
      "how it was when the sensor was tared, or take the sensor's zero before (proxarm zero)");
}

Change LiveParameters::take_lookahead(const std::string& text) {
  if (!session_.settings.looks_ahead) {
    refuse("lookahead", "a session without lookahead", "one that was started with --lookahead auto or a time",
           "start a new session with --lookahead");
  }
  PreparedSession changed = session_;
  changed.lookahead = LookaheadChoice::parse(std::string_view(text).substr(text.find('=') + 1), "lookahead");
  choose_horizon(changed);
  RunOptions judged = options_;
  judged.mass_kg = changed.settings.mass_kg;
  require_stable(changed, judged);
  session_ = std::move(changed);
  return {
      .parameter = Parameter::lookahead, .value = session_.settings.horizon_s, .period_s = session_.settings.period_s};
}

namespace {

struct Script {
  std::vector<ScheduledChange> changes;
  std::vector<ScheduledTimestep> timesteps;
};

struct TimedText {
  double time_s;
  std::string text, time;  // time: as the user wrote it
};

// Parses changes with their times, such as "mass=3@4s" (after four seconds of rendering), and sorts them by time.
// Throws SetupError.
std::vector<TimedText> timed_texts(const std::vector<std::string>& texts) {
  std::vector<TimedText> timed;
  for (const std::string& text : texts) {
    const std::size_t at = text.rfind('@');
    if (at == std::string::npos) {
      throw SetupError({.key = "--set",
                        .found = description::in_quotes(text),
                        .expected = "NAME=VALUE@TIME",
                        .advice = "such as mass=3@4s: after four seconds of rendering"});
    }
    const std::string time = text.substr(at + 1);
    timed.push_back({description::parse_duration(time, "--set"), text.substr(0, at), time});
  }
  std::stable_sort(timed.begin(), timed.end(),
                   [](const TimedText& a, const TimedText& b) { return a.time_s < b.time_s; });
  return timed;
}

// Returns take(change). If take() refuses the change, the error that is thrown names the change and its line. The
// reason may concern another quantity (a new timestep may need a larger mass); then the error names that quantity, too.
template <typename Take>
auto taken_from(const std::string& line, const std::string& change, Take take) {
  try {
    return take(change);
  } catch (const SetupError& error) {
    description::SetupProblem problem = error.problem();
    std::string about = problem.key;
    about.erase(0, std::min(about.find_first_not_of('-'), about.size()));
    const std::string own = change.substr(0, change.find('='));
    problem.key = about.empty() || about == own || about == "set" ? line : line + ": " + about;
    throw SetupError(problem);
  }
}

Script script_of(const std::vector<std::string>& texts, const PreparedSession& session, const RunOptions& options) {
  LiveParameters parameters(session, options);
  Script script;
  for (const TimedText& change : timed_texts(texts)) {
    const std::int64_t rendered_ns = std::llround(1e9 * change.time_s);
    const std::string line = "--set " + change.text + "@" + change.time;
    const auto timestep = [&](const std::string& text) { return parameters.take_timestep(text); };
    const auto other = [&](const std::string& text) { return parameters.take(text); };
    if (LiveParameters::is_timestep(change.text)) {
      script.timesteps.push_back({rendered_ns, taken_from(line, change.text, timestep)});
    } else {
      script.changes.push_back({rendered_ns, taken_from(line, change.text, other)});
    }
  }
  return script;
}

// Passes an order from the socket on to the session, and returns the answer. Returns nullopt if the line isn't an
// order.
std::optional<std::string> obey(Cycle& cycle, const std::string& line) {
  const auto command = parse_order(line);
  if (!command) return std::nullopt;
  const char* const refusal = cycle.status().refusal(command->order);
  if (refusal != nullptr) throw SetupError({.message = refusal});
  if (!cycle.commands().push(*command)) throw SetupError({.found = "too many commands at once"});
  return line;
}

std::vector<std::string> split_at_tabs(const std::string& line) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, '\t');) parts.push_back(part);
  return parts;
}

bool is_of_tool(const Change& change) { return change.parameter == Parameter::tool; }

// Makes all changes of a line, or none if one of them is refused. Throws SetupError if one is refused.
void change_all(Cycle& cycle, LiveParameters& parameters, const std::vector<std::string>& texts) {
  LiveParameters changed = parameters;
  std::vector<Change> changes;
  for (const std::string& text : texts) {
    if (LiveParameters::is_timestep(text)) {
      refuse("timestep", "one that is set together with others", "one that is set by itself",
             "set the others when the drives have confirmed it: what they may be depends on it");
    }
    const Change change = taken_from(text, text, [&](const std::string& one) { return changed.take(one); });
    // The tool's mass and centre of mass are checked together. The later change of the tool holds both, so an earlier
    // change of the tool is dropped.
    if (change.parameter == Parameter::tool) std::erase_if(changes, is_of_tool);
    changes.push_back(change);
  }
  if (std::any_of(changes.begin(), changes.end(), is_of_tool)) {
    changed.require_tool(parameters, cycle.status().tool_evidence());
  }
  if (cycle.changes().room() < changes.size()) {
    throw SetupError({.found = "a session that takes no changes now", .expected = "one that renders"});
  }
  for (const Change& change : changes) cycle.changes().push(change);
  parameters = std::move(changed);
}

// Makes the changes of a line from the socket, and returns the answer.
std::string change(Cycle& cycle, LiveParameters& parameters, const std::string& line) {
  if (cycle.status().changes_timestep() || cycle.status().answered_timesteps() != parameters.asked_timesteps()) {
    refuse(line, "a timestep that is being changed", "a session that has one", "ask again in a moment");
  }
  parameters.follow(cycle.status().period_s());
  if (LiveParameters::is_timestep(line) && line.find('\t') == std::string::npos) {
    if (const char* const refusal = cycle.status().timestep_refusal())
      throw SetupError({.key = "timestep", .message = refusal});
    const auto timestep =
        taken_from(line, line, [&](const std::string& text) { return parameters.take_timestep(text); });
    if (!cycle.timesteps().push(timestep)) throw SetupError({.key = line, .found = "too many at once"});
    parameters.count_timestep();
    return line + ": the arm stops, the drives are told, rendering goes on; the session says whether all have taken it";
  }
  change_all(cycle, parameters, split_at_tabs(line));
  return line;
}

}  // namespace

void require_changeable(const PreparedSession& session, const std::string& key) {
  if (!session.impedance()) return;
  throw SetupError(
      {.key = key,
       .found = "the impedance type",
       .expected =
           "--scheme admittance: mass, damping and spring are the proxy's, and torques are made for one timestep"});
}

void require_changes(const PreparedSession& session, const RunOptions& options) {
  if (!options.changes.empty()) require_changeable(session, "--set");
  if (!options.orders.empty()) require_changeable(session, "--do");
  if (!options.control.empty()) require_changeable(session, "--control");
  (void)script_of(options.changes, session, options);
  (void)scheduled_orders(options.orders);
  if (!options.control.empty()) require_control_path(control_path(options));
}

std::vector<IdleChange> idle_changes(const Cycle& cycle, const std::vector<std::string>& texts) {
  std::vector<IdleChange> idle;
  const auto note = [&](const TimedText& change, const auto& scheduled) {
    if (scheduled.taken && scheduled.refusal == nullptr) return;
    idle.push_back({change.text, change.time_s, scheduled.taken ? scheduled.refusal : "the session had ended before"});
  };
  // timed_texts() returns the changes in the order in which they were scheduled.
  auto next = cycle.scheduled_changes().begin();
  auto next_timestep = cycle.scheduled_timesteps().begin();
  for (const TimedText& change : timed_texts(texts)) {
    LiveParameters::is_timestep(change.text) ? note(change, *next_timestep++) : note(change, *next++);
  }
  return idle;
}

void schedule_changes(Cycle& cycle, const PreparedSession& session, const RunOptions& options) {
  Script script = script_of(options.changes, session, options);
  cycle.changes().schedule(std::move(script.changes));
  cycle.timesteps().schedule(std::move(script.timesteps));
  cycle.commands().schedule(scheduled_orders(options.orders));
}

ControlHandlers control_handlers(Cycle& cycle, const PreparedSession& session, const RunOptions& options,
                                 const BoxReader& box) {
  // Each ring of the cycle has one writer at a time. An order waits for no change that is being judged.
  struct Writers {
    std::mutex orders, changes;
    LiveParameters parameters;
  };
  const std::shared_ptr<Writers> writers(new Writers{{}, {}, LiveParameters(session, options)});
  return {[&cycle, &box, &session, writers](const std::string& line) {
            if (auto status = session_status(line, box, session)) return status;
            const std::lock_guard<std::mutex> one(writers->orders);
            return obey(cycle, line);
          },
          [&cycle, writers](const std::string& line) {
            const std::lock_guard<std::mutex> one(writers->changes);
            return change(cycle, writers->parameters, line);
          }};
}

std::unique_ptr<ControlSocket> control_socket(const RunOptions& options, ControlHandlers handlers) {
  if (options.control.empty()) return nullptr;
  return std::make_unique<ControlSocket>(control_path(options), std::move(handlers));
}

}  // namespace proxarm::controller
