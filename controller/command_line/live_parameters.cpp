#include "controller/command_line/live_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "controller/command_line/orders.hpp"
#include "models/description/quantity.hpp"
#include "models/description/setup_error.hpp"
#include "models/description/text.hpp"
#include "scenes/compile.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using controller::Change;
using controller::Parameter;
using description::SetupError;

struct Live {
  const char* name;
  Parameter parameter;
  double (*parse)(std::string_view text, std::string_view option);
};

constexpr Live live[] = {{"mass", Parameter::mass, description::parse_mass},
                         {"damping", Parameter::damping, description::parse_damping},
                         {"spring", Parameter::spring, description::parse_stiffness}};

const Live& find(const std::string& text) {
  const std::string name = text.substr(0, text.find('='));
  std::vector<std::string> known;
  for (const Live& parameter : live) {
    if (name == parameter.name && text.find('=') != std::string::npos) return parameter;
    known.emplace_back(parameter.name);
  }
  throw SetupError(
      {.key = "--set",
       .found = description::in_quotes(text),
       .expected = "NAME=VALUE with NAME " + description::one_of(known) + ", or OBJECT.friction, OBJECT.position_m"});
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

constexpr double most_friction = 10.0;
constexpr double farthest_m = 10.0;

// "NAME.friction=MU", "NAME.position_m=X,Y,Z". Nothing where there is no such key.
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
    if (scenes::compile(scene).has_friction(static_cast<std::size_t>(change.object))) return change;
    refuse(key, "a single wall without friction, which is compiled without, or friction by region",
           "an object whose friction can change", "give it some in the scene file, such as friction: 0.001");
  }
  change.parameter = Parameter::position;
  if (!object->motion || !object->motion->driven) {
    refuse(key, "an object that stands still", "an object that is driven",
           "give it motion: {driven: true} in the scene file");
  }
  std::istringstream parts(value + ",");
  for (double& x : change.position_m) {
    std::string part;
    std::getline(parts, part, ',');
    x = number_of(part, key, "three numbers X,Y,Z, metres from where it is described, at most 10", -farthest_m,
                  farthest_m);
  }
  if (parts.peek() != std::istringstream::traits_type::eof())
    refuse(key, description::in_quotes(value), "three numbers");
  return change;
}

fs::path control_path(const RunOptions& options) {
  return options.control == "default" ? default_control_path() : options.control;
}

}  // namespace

LiveParameters::LiveParameters(const PreparedSession& session, const RunOptions& options)
    : session_(session), options_(options) {}

controller::Change LiveParameters::take(const std::string& text) {
  if (text.compare(0, 9, "timestep=") == 0) {
    refuse(
        "timestep", "a change while rendering",
        "a new session with --timestep: drives take their interpolation period (60C2h) before they are enabled only");
  }
  if (const std::optional<Change> change = change_of_object(text, session_.scene)) return *change;
  const Live& parameter = find(text);
  const double value = parameter.parse(text.substr(text.find('=') + 1), parameter.name);
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
    case Parameter::friction:
    case Parameter::position:
    case Parameter::none:
      break;
  }
  RunOptions judged = options_;
  judged.mass_kg = changed.settings.mass_kg;  // so that the message names it
  require_stable(changed, judged);
  session_ = std::move(changed);
  const double handle_kg = parameter.parameter == Parameter::mass ? session_.cell.tool.mass_kg : 0.0;
  return {parameter.parameter, value - handle_kg};
}

namespace {

// "mass=3@4s", after four seconds of rendering, in any order of times. Throws SetupError.
std::vector<controller::ScheduledChange> scheduled_changes(const std::vector<std::string>& texts,
                                                           const PreparedSession& session, const RunOptions& options) {
  struct Timed {
    double time_s;
    std::string text;
  };
  std::vector<Timed> timed;
  for (const std::string& text : texts) {
    const std::size_t at = text.rfind('@');
    if (at == std::string::npos) {
      throw SetupError({.key = "--set",
                        .found = description::in_quotes(text),
                        .expected = "NAME=VALUE@TIME",
                        .advice = "such as mass=3@4s: after four seconds of rendering"});
    }
    timed.push_back({description::parse_duration(text.substr(at + 1), "--set"), text.substr(0, at)});
  }
  std::stable_sort(timed.begin(), timed.end(), [](const Timed& a, const Timed& b) { return a.time_s < b.time_s; });
  LiveParameters parameters(session, options);
  std::vector<controller::ScheduledChange> changes;
  for (const Timed& change : timed) {
    const auto cycles = static_cast<std::uint64_t>(std::llround(change.time_s / session.settings.period_s));
    changes.push_back({cycles, parameters.take(change.text)});
  }
  return changes;
}

}  // namespace

void require_changes(const PreparedSession& session, const RunOptions& options) {
  const bool asked = !options.changes.empty() || !options.control.empty() || !options.orders.empty();
  if (session.impedance() && asked) {
    throw SetupError({.key = !options.changes.empty()  ? "--set"
                             : !options.orders.empty() ? "--do"
                                                       : "--control",
                      .found = "the impedance type",
                      .expected = "--scheme admittance: mass, damping and spring are the proxy's"});
  }
  (void)scheduled_changes(options.changes, session, options);
  (void)scheduled_orders(options.orders);
  if (!options.control.empty()) require_control_path(control_path(options));
}

std::unique_ptr<ControlSocket> take_changes(controller::Cycle& cycle, const PreparedSession& session,
                                            const RunOptions& options) {
  cycle.schedule(scheduled_changes(options.changes, session, options));
  cycle.schedule(scheduled_orders(options.orders));
  if (options.control.empty()) return nullptr;
  const auto parameters = std::make_shared<LiveParameters>(session, options);
  return std::make_unique<ControlSocket>(
      control_path(options), [&cycle, parameters](const std::string& line) -> std::string {
        if (const auto command = parse_order(line)) {
          const char* const refusal = cycle.refusal(command->order);
          if (refusal != nullptr) throw SetupError({.message = refusal});
          if (!cycle.commands().push(*command)) throw SetupError({.found = "too many commands at once"});
          return line;
        }
        const controller::Change change = parameters->take(line);
        if (!cycle.changes().push(change)) {
          throw SetupError({.found = "a session that takes no changes now", .expected = "one that renders"});
        }
        return line;
      });
}

}  // namespace proxarm::command_line
