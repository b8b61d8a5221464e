#include "controller/command_line/live_parameters.hpp"

#include <algorithm>
#include <cmath>

#include "models/description/quantity.hpp"
#include "models/description/setup_error.hpp"
#include "models/description/text.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
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
  throw SetupError({.key = "--set",
                    .found = description::in_quotes(text),
                    .expected = "NAME=VALUE with NAME " + description::one_of(known)});
}

fs::path control_path(const RunOptions& options) {
  return options.control == "default" ? default_control_path() : options.control;
}

}  // namespace

LiveParameters::LiveParameters(const PreparedSession& session, const RunOptions& options)
    : session_(session), options_(options) {}

controller::Change LiveParameters::take(const std::string& text) {
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
  if (session.impedance() && (!options.changes.empty() || !options.control.empty())) {
    throw SetupError({.key = options.changes.empty() ? "--control" : "--set",
                      .found = "the impedance type",
                      .expected = "--scheme admittance: mass, damping and spring are the proxy's"});
  }
  (void)scheduled_changes(options.changes, session, options);
  if (!options.control.empty()) require_control_path(control_path(options));
}

std::unique_ptr<ControlSocket> take_changes(controller::Cycle& cycle, const PreparedSession& session,
                                            const RunOptions& options) {
  cycle.schedule(scheduled_changes(options.changes, session, options));
  if (options.control.empty()) return nullptr;
  const auto parameters = std::make_shared<LiveParameters>(session, options);
  return std::make_unique<ControlSocket>(
      control_path(options), [&cycle, parameters](const std::string& line) -> std::string {
        const controller::Change change = parameters->take(line);
        if (!cycle.changes().push(change)) {
          throw SetupError({.found = "a session that takes no changes now", .expected = "one that renders"});
        }
        return line;
      });
}

}  // namespace proxarm::command_line
