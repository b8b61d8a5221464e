#include "controller/preparation/run_options.hpp"

#include <algorithm>
#include <sstream>

#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {
namespace {

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
  throw description::SetupError({.key = "--bus", .found = found, .expected = expected});
}

}  // namespace

LookaheadChoice LookaheadChoice::parse(std::string_view text, std::string_view option) {
  if (text == "off") return {};
  if (text == "auto") return {Kind::automatic, 0.0};
  // With a longer horizon, the hand would feel the arm's response to a push before the hand can react.
  constexpr double longest_s = 0.1;
  const auto refuse = [&] {
    throw description::SetupError({.key = std::string(option),
                                   .found = description::in_quotes(std::string(text)),
                                   .expected = "auto, off, or a time of at most 100 ms, such as 8ms"});
  };
  double horizon_s = 0.0;
  try {
    horizon_s = description::parse_duration(text, option);
  } catch (const description::SetupError&) {
    refuse();
  }
  if (!(horizon_s >= 0.0 && horizon_s <= longest_s)) refuse();
  return horizon_s > 0.0 ? LookaheadChoice{Kind::fixed, horizon_s} : LookaheadChoice{};
}

BusMapping BusMapping::parse(const std::string& text) {
  BusMapping mapping;
  if (text == "sim") return mapping;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos) {
      if (text.find_first_of(",=") != std::string::npos || part.empty()) {
        refuse("'" + text + "'", "sim, one interface, or NAME=INTERFACE,NAME=INTERFACE,…");
      }
      mapping.all_ = part;
      continue;
    }
    const std::string bus = part.substr(0, equals), interface = part.substr(equals + 1);
    if (bus.empty() || interface.empty() || interface.find('=') != std::string::npos) {
      refuse("'" + part + "'", "NAME=INTERFACE");
    }
    if (!mapping.by_bus_.emplace(bus, interface).second) refuse("'" + bus + "' twice", "each bus once");
  }
  if (mapping.simulated()) refuse("'" + text + "'", "sim, one interface, or NAME=INTERFACE,NAME=INTERFACE,…");
  return mapping;
}

std::vector<std::string> BusMapping::interfaces(const std::vector<std::string>& bus_names) const {
  for (const auto& [bus, interface] : by_bus_) {
    if (std::find(bus_names.begin(), bus_names.end(), bus) == bus_names.end()) {
      refuse("'" + bus + "'", "a bus of the cell: " + join(bus_names));
    }
  }
  std::vector<std::string> interfaces;
  for (const std::string& bus : bus_names) {
    const auto found = by_bus_.find(bus);
    if (found == by_bus_.end() && !all_) refuse("no interface for '" + bus + "'", "one for each of " + join(bus_names));
    interfaces.push_back(found != by_bus_.end() ? found->second : *all_);
  }
  return interfaces;
}

void require_interface_for_hardware(const RunOptions& options) {
  if (options.hardware.empty() || !options.bus.simulated()) return;
  throw description::SetupError({.key = "--hardware",
                                 .found = "--bus sim (the default), where the arm is simulated",
                                 .expected = "the real arm's interfaces with it",
                                 .advice = "such as --hardware --bus can0, or NAME=can0,NAME=can1 for a cell with "
                                           "several buses; for the simulated arm leave --hardware away"});
}

}  // namespace proxarm::controller
