#include "controller/extras/assessment/assessment_report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "models/files/json.hpp"

namespace proxarm::assessment {
namespace {

using description::Json;

constexpr const char* statement =
    "A simulation of the values that the cell file has under simulation:, not a measurement of an arm. It certifies "
    "nothing.";

template <typename... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return std::string(text.data()) + "\n";
}

const char* what_it_does(Stop stop) {
  switch (stop) {
    case Stop::category_0:
      return "0, power off, brakes close";
    case Stop::category_1:
      return "1, controlled, then off";
    default:
      return "2, controlled, drives stay on";
  }
}

int category(Stop stop) { return static_cast<int>(stop) - static_cast<int>(Stop::category_0); }

const char* where(bool felt) {
  return felt ? "pressed by the handle: the sensor feels it" : "pressed by the arm in front of the sensor: unfelt";
}

std::string brakes(const Subject& s) {
  if (s.assumed_brakes == 0) return "brakes: as the cell says (brake_torque_Nm, brake_delay_s)\n";
  return line("brakes: ASSUMED for %d drives whose cell doesn't say: %.2g of max_torque_Nm, closed after %.0f ms",
              s.assumed_brakes, s.assumed_brake_share, 1e3 * s.assumed_brake_delay_s);
}

// Returns the body region with this body's stiffness; nullptr if no region has it.
const Region* region_of(const ClampFigure& clamp, const Thresholds& thresholds) {
  for (const Region& region : thresholds.regions) {
    if (region.stiffness_N_per_m == clamp.stiffness_N_per_m) return &region;
  }
  return nullptr;
}

bool exceeds(const ClampFigure& clamp, const Region& region) {
  return clamp.transient_N > region.transient_N || clamp.quasi_static_N > region.quasi_static_N;
}

std::string verdict(const ClampFigure& clamp, const Thresholds& thresholds) {
  std::string words;
  for (const Region& region : thresholds.regions) {
    if (region.stiffness_N_per_m != clamp.stiffness_N_per_m) continue;
    words += std::string(words.empty() ? "" : "; ") + (exceeds(clamp, region) ? "ABOVE " : "within ") + region.name;
  }
  return words;
}

std::string stops_text(const Assessment& assessment) {
  std::string text = line("%-42s %8s %10s   %s", "stop category", "time", "distance", "worst distance: from, in, led");
  for (std::size_t i = 0; i < assessment.stops.size(); ++i) {
    const StopFigure& s = assessment.stops[i];
    text += line("  %-40s %s%4.0f ms %7.1f mm   %.3f m/s, pose %d, %s", what_it_does(s.stop), s.at_rest ? "  " : "> ",
                 1e3 * assessment.longest_stop_s[i], 1e3 * s.distance_m, s.from_m_per_s, s.pose, s.direction.c_str());
  }
  return text;
}

std::string clamps_text(const Assessment& assessment, const Thresholds& thresholds) {
  std::string text;
  bool felt = false;
  for (std::size_t i = 0; i < assessment.clamps.size(); ++i) {
    const ClampFigure& c = assessment.clamps[i];
    if (i == 0 || c.felt != felt) {
      text += line("%-49s %8s %8s %8s %8s", where(c.felt), "0.5 s", "later", "at last", "energy");
      felt = c.felt;
    }
    text +=
        line("  a body of %4.0f N/mm, %.2f m/s, pose %d, %-11s %6.0f N %6.0f N %6.0f N %6.2f J  %s%s%s",
             1e-3 * c.stiffness_N_per_m, c.at_m_per_s, c.pose, c.direction.c_str(), c.transient_N, c.quasi_static_N,
             c.left_N, c.energy_J, verdict(c, thresholds).c_str(), c.end.empty() ? "" : "  ended by ", c.end.c_str());
  }
  return text;
}

std::string thresholds_text(const Thresholds& thresholds) {
  std::string text;
  for (const Region& region : thresholds.regions) {
    text += line("  %s: %.0f N in the first half second, %.0f N later, at %.0f N/mm", region.name.c_str(),
                 region.transient_N, region.quasi_static_N, 1e-3 * region.stiffness_N_per_m);
  }
  return "thresholds: " + thresholds.source + "\n" + text;
}

Json stops_json(const Assessment& assessment) {
  Json list = Json::array();
  for (std::size_t i = 0; i < assessment.stops.size(); ++i) {
    const StopFigure& s = assessment.stops[i];
    list.push_back({{"category", category(s.stop)},
                    {"time_s", assessment.longest_stop_s[i]},
                    {"distance_m", s.distance_m},
                    {"at_rest", s.at_rest},
                    {"from_m_per_s", s.from_m_per_s},
                    {"pose", s.pose},
                    {"direction", s.direction}});
  }
  return list;
}

Json clamps_json(const Assessment& assessment, const Thresholds& thresholds) {
  Json list = Json::array();
  for (const ClampFigure& c : assessment.clamps) {
    Json clamp{{"felt", c.felt},
               {"stiffness_N_per_m", c.stiffness_N_per_m},
               {"at_m_per_s", c.at_m_per_s},
               {"transient_N", c.transient_N},
               {"quasi_static_N", c.quasi_static_N},
               {"left_N", c.left_N},
               {"energy_J", c.energy_J},
               {"pose", c.pose},
               {"direction", c.direction},
               {"ended_by", c.end}};
    if (const Region* region = region_of(c, thresholds)) {
      clamp["exceeds"] = exceeds(c, *region);
    }
    list.push_back(clamp);
  }
  return list;
}

Json thresholds_json(const Thresholds& thresholds) {
  Json regions = Json::array();
  for (const Region& region : thresholds.regions) {
    regions.push_back({{"name", region.name},
                       {"stiffness_N_per_m", region.stiffness_N_per_m},
                       {"transient_N", region.transient_N},
                       {"quasi_static_N", region.quasi_static_N}});
  }
  return {{"source", thresholds.source}, {"regions", regions}};
}

}  // namespace

std::vector<std::string> exceeded(const Assessment& assessment, const Thresholds& thresholds) {
  std::vector<std::string> names;
  for (const Region& region : thresholds.regions) {
    const bool any = std::any_of(assessment.clamps.begin(), assessment.clamps.end(), [&](const ClampFigure& clamp) {
      return clamp.stiffness_N_per_m == region.stiffness_N_per_m && exceeds(clamp, region);
    });
    if (any) names.push_back(region.name);
  }
  return names;
}

std::string text(const Subject& s, const Assessment& assessment, const Thresholds& thresholds) {
  std::string text = std::string(statement) + "\n";
  text += line("%s, led by %s: %.4g N/m, %.4g Ns/m, %.3g kg; %.3g kg felt, T = %.4g ms, tool at most %.3g m/s",
               s.cell.c_str(), s.hand.c_str(), s.stiffness_N_per_m, s.damping_Ns_per_m, s.hand_mass_kg, s.felt_mass_kg,
               1e3 * s.period_s, s.max_tool_speed_m_per_s);
  for (std::size_t pose = 0; pose < assessment.poses_rad.size(); ++pose) {
    text += "pose " + std::to_string(pose) + ":";
    for (const double angle : assessment.poses_rad[pose]) {
      std::string number = line(" %.3f", angle);
      number.pop_back();
      text += number;
    }
    text += pose == 0 ? " rad, the start\n" : " rad\n";
  }
  text += brakes(s) + stops_text(assessment) + clamps_text(assessment, thresholds) + thresholds_text(thresholds);
  const std::vector<std::string> names = exceeded(assessment, thresholds);
  if (names.empty()) return text + "no threshold is exceeded in these trials\n";
  text += "EXCEEDED:";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? " " : ", ") + names[i];
  return text + "\n";
}

std::string json(const Subject& s, const Assessment& assessment, const Thresholds& thresholds) {
  Json json{{"certifies", "nothing"}, {"statement", statement}, {"cell", s.cell}, {"hand", s.hand}};
  json.update({{"wanted_mass_kg", s.felt_mass_kg},
               {"period_s", s.period_s},
               {"max_tool_speed_m_per_s", s.max_tool_speed_m_per_s},
               {"assumed_brakes", s.assumed_brakes},
               {"poses_rad", assessment.poses_rad},
               {"stops", stops_json(assessment)},
               {"clamps", clamps_json(assessment, thresholds)},
               {"thresholds", thresholds_json(thresholds)},
               {"exceeded", exceeded(assessment, thresholds)}});
  return json.dump() + "\n";
}

}  // namespace proxarm::assessment
