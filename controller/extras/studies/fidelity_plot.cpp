#include "controller/extras/studies/fidelity_plot.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/fidelity_bands.hpp"

namespace proxarm::studies {
namespace {

// The plots show the limit of 10 %, and sessions with the timestep that most sessions have.
constexpr double asked_limit = 0.1, drawn_period_s = 1e-3;

// A drawn setup, and at each frequency the largest error of all directions.
struct Drawn {
  std::string name{};  // name in the key
  double mass = 0.0;   // for a tool that turns: the inertia
  bool looks_ahead = false, torque = false;
  std::map<double, double> error_of_Hz{};
};

bool flag(const Table& table, std::size_t row, const char* name) {
  return table.number(row, table.column(name)) != 0.0;
}

// Returns whether a row is of the default cell with unchanged drives, at the drawn timestep.
bool is_usual(const Table& table, std::size_t row) {
  return table.text(row, table.column("cell")) == "default" && table.number(row, table.column("drive_factor")) == 1.0 &&
         table.number(row, table.column("period_s")) == drawn_period_s;
}

enum class Way { free, wall, turning };

Way way_of(const Table& table, std::size_t row) {
  if (is_turning(table, row)) return Way::turning;
  return flag(table, row, "wall") ? Way::wall : Way::free;
}

// Returns all usual setups of one kind of motion, in the order of mass, lookahead, torque.
std::vector<Drawn> usual_setups(const Table& table, Way way) {
  const std::size_t error = table.column(way == Way::turning ? "inertia_error" : "mass_error"),
                    mass = table.column(way == Way::turning ? "inertia_kg_m2" : "mass_kg"),
                    frequency = table.column("frequency_Hz");
  std::vector<Drawn> list;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (!is_usual(table, row) || way_of(table, row) != way || !std::isfinite(table.number(row, error))) continue;
    const Drawn wanted{.mass = table.number(row, mass),
                       .looks_ahead = flag(table, row, "lookahead"),
                       .torque = flag(table, row, "torque")};
    auto at = std::ranges::find_if(list, [&wanted](const Drawn& d) {
      return d.mass == wanted.mass && d.looks_ahead == wanted.looks_ahead && d.torque == wanted.torque;
    });
    if (at == list.end()) at = list.insert(at, wanted);
    const double f = table.number(row, frequency), e = table.number(row, error);
    const auto [found, is_new] = at->error_of_Hz.emplace(f, e);
    if (!is_new) found->second = std::max(found->second, e);
  }
  std::ranges::sort(list, {}, [](const Drawn& d) { return std::tuple(d.mass, d.looks_ahead, d.torque); });
  for (Drawn& drawn : list) {
    drawn.name = number_text(drawn.mass, 3) + (way == Way::turning ? " kg m²" : " kg");
    if (drawn.looks_ahead) drawn.name += drawn.torque ? ", lookahead and torque" : ", lookahead";
  }
  return list;
}

// Returns the setups of one mass: the mass with most measured variants of lookahead and torque, and of several such
// masses the largest.
std::vector<Drawn> one_mass(const Table& table) {
  std::vector<Drawn> list = usual_setups(table, Way::free);
  std::map<double, int> count;
  for (const Drawn& drawn : list) ++count[drawn.mass];
  double chosen = 0.0;
  for (const auto& [mass, setups] : count) {
    if (chosen == 0.0 || setups >= count.at(chosen)) chosen = mass;
  }
  std::erase_if(list, [chosen](const Drawn& drawn) { return drawn.mass != chosen; });
  return list;
}

std::string timestep_text() { return "At T = " + number_text(1e3 * drawn_period_s, 3) + " ms "; }

// Returns the setup whose band ends at the lowest frequency.
const Drawn& least_of(const std::vector<Drawn>& setups) {
  return *std::ranges::min_element(setups, {},
                                   [](const Drawn& drawn) { return band_Hz(drawn.error_of_Hz, asked_limit); });
}

// Returns a panel with the errors in per cent and the limits. A ring marks the point at which an error passes 10 %: for
// each setup, or, with `turning`, only for the inertia whose error passes 10 % at the lowest frequency.
Panel error_panel(const std::vector<Drawn>& setups, bool turning) {
  Panel panel{.title = std::string("Error of the ") + (turning ? "inertia" : "mass") + " felt, " +
                       (turning ? "about the worst axis" : "in the worst direction"),
              .x_label = "frequency (Hz)",
              .y_label = turning ? "|τ/α − J|/J (%)" : "|F/a − M|/M (%)",
              .log_x = true,
              .log_y = true,
              .x_low = 0.08,
              .x_high = 40.0,
              .y_low = 0.05,
              .y_high = 1000.0,
              .x_ticks = {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0}};
  for (const Drawn& drawn : setups) {
    Curve curve{.name = drawn.name, .style = static_cast<int>(panel.curves.size()), .marks = true};
    for (const auto& [f, error] : drawn.error_of_Hz) {
      curve.x.push_back(f);
      curve.y.push_back(100.0 * error);
    }
    panel.curves.push_back(curve);
  }
  for (const double limit : fidelity_limits) panel.levels.push_back({100.0 * limit, percent_text(limit)});
  double last = 0.0;
  for (const Drawn& drawn : setups) {
    const double band = band_Hz(drawn.error_of_Hz, asked_limit);
    if (!(band > 0.0) || !(band < 0.99 * drawn.error_of_Hz.rbegin()->first)) continue;
    if (turning && &drawn != &least_of(setups)) continue;
    const std::string how = turning              ? ""
                            : !drawn.looks_ahead ? ": plain"
                            : drawn.torque       ? ": and torque"
                                                 : ": lookahead";
    panel.notes.push_back({band, 100.0 * asked_limit, number_text(band, 2) + " Hz" + how,
                           last > 0.5 * band ? Note::Side::right
                           : turning         ? Note::Side::above
                                             : Note::Side::left});
    last = band;
  }
  return panel;
}

}  // namespace

std::string fidelity_answer(const Table& table) {
  const std::vector<Drawn> setups = one_mass(table);
  if (setups.empty()) return "What the hand feels at the simulated arm";
  std::string answer =
      timestep_text() + number_text(setups[0].mass, 3) + " kg feels right within " + percent_text(asked_limit);
  for (const Drawn& drawn : setups) {
    if (&drawn != &setups[0]) answer += ",";
    if (drawn.looks_ahead) answer += drawn.torque ? " with lookahead and torque" : " with lookahead";
    answer += " " + band_text(drawn.error_of_Hz, asked_limit);
  }
  return answer + " (worst direction)";
}

std::string fidelity_turning_answer(const Table& table) {
  const std::vector<Drawn> setups = usual_setups(table, Way::turning);
  if (setups.empty()) return "What the hand feels of a tool that it turns";
  const Drawn& least = least_of(setups);
  std::string inertias = number_text(setups.front().mass, 3);
  if (setups.size() > 1) inertias += " to " + number_text(setups.back().mass, 3);
  return timestep_text() + inertias + " kg m² " + (setups.size() > 1 ? "all feel" : "feels") + " right within " +
         percent_text(asked_limit) + " " + band_text(least.error_of_Hz, asked_limit) + " (worst axis)";
}

std::vector<std::string> draw_fidelity(const Table& table, const std::filesystem::path& out) {
  Chart place{.title = fidelity_answer(table),
              .subtitle = "Default cell, simulated; torque: drives that measure the torque of their gears",
              .panel_height = 330,
              .key = true};
  Chart turning = place;
  turning.title = fidelity_turning_answer(table);
  turning.subtitle = "Default cell, simulated; a tool that the hand turns about x, y and z";
  if (const std::vector<Drawn> setups = one_mass(table); !setups.empty()) {
    place.panels = {error_panel(setups, false)};
  }
  if (const std::vector<Drawn> setups = usual_setups(table, Way::turning); !setups.empty()) {
    turning.panels = {error_panel(setups, true)};
  }
  std::vector<std::string> warnings;
  for (const auto& [chart, file] : {std::pair{&place, "fidelity.svg"}, std::pair{&turning, "fidelity_turning.svg"}}) {
    const std::string warning = draw(*chart, out / file);
    if (!warning.empty()) warnings.push_back(warning);
  }
  return warnings;
}

}  // namespace proxarm::studies
