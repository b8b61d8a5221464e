#include "controller/extras/studies/stability_plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/common/map_chart.hpp"

namespace proxarm::studies {
namespace {

// The drawn part of the map is that of (26) with drives of 100 Hz.
constexpr double drawn_order = 1.0, drawn_drive_s = 1.6e-3;

// The mass and the damping of the hand in the drawn part.
constexpr double hand_kg = 1.0, hand_Ns_per_m = 20.0;

class Points {
 public:
  explicit Points(const Table& table)
      : table_(table),
        order_(table.column("order")),
        drive_(table.column("drive_time_constant_s")),
        delay_(table.column("delay_s")),
        mass_(table.column("hand_mass_kg")),
        damping_(table.column("damping_Ns_per_m")) {}

  [[nodiscard]] double value(std::size_t row, const char* name) const {
    return table_.number(row, table_.column(name));
  }
  [[nodiscard]] bool is_drawn(std::size_t row, double delay_s) const {
    return is_drawn(row) && table_.number(row, delay_) == delay_s && table_.number(row, mass_) == hand_kg &&
           table_.number(row, damping_) == hand_Ns_per_m;
  }
  [[nodiscard]] bool is_drawn(std::size_t row) const {
    return table_.number(row, order_) == drawn_order && table_.number(row, drive_) == drawn_drive_s;
  }
  [[nodiscard]] std::vector<double> grid(const char* name) const {
    std::set<double> values;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      if (is_drawn(row)) values.insert(value(row, name));
    }
    return {values.begin(), values.end()};
  }

 private:
  const Table& table_;
  std::size_t order_, drive_, delay_, mass_, damping_;
};

// A mass that is stable with hands up to a stiffness, up_to_N_per_m, at one timestep and delay.
struct Enough {
  double period_s = 0.0, delay_s = 0.0, mass_kg = 0.0, up_to_N_per_m = 0.0;
  bool all = true;  // true: some mass is stable with every stiffness that was tried
};

Enough enough_of(const Table& table, double delay_s) {
  const Points points(table);
  Enough found{.delay_s = delay_s};
  for (const double T : points.grid("period_s")) {
    if (std::abs(T - 1e-3) < std::abs(found.period_s - 1e-3)) found.period_s = T;
  }
  std::map<double, double> smallest_kg;  // for each stiffness of the hand; negative: no mass is stable
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (!points.is_drawn(row, found.delay_s) || points.value(row, "period_s") != found.period_s) continue;
    smallest_kg[points.value(row, "stiffness_N_per_m")] = points.value(row, "predicted_kg");
  }
  for (const auto& [stiffness, mass_kg] : smallest_kg) {
    if (!(mass_kg > 0.0)) {
      found.all = false;
      break;
    }
    found.mass_kg = std::max(found.mass_kg, mass_kg);
    found.up_to_N_per_m = stiffness;
  }
  return found;
}

std::string limit_text(const Enough& limit) {
  return number_text(limit.up_to_N_per_m, 3) + " N/m" + (limit.all ? " and more" : "");
}

std::string milliseconds(double s) { return number_text(1e3 * s, 2) + " ms"; }

std::string delay_text(double delay_s) { return delay_s > 0.0 ? "T + " + milliseconds(delay_s) : "T alone"; }

// Returns at most three delays, among them the shortest and the longest.
std::vector<double> drawn_delays(const Points& points) {
  const std::vector<double> all = points.grid("delay_s");
  if (all.size() <= 3) return all;
  return {all.front(), all[all.size() / 2], all.back()};
}

Map map_of(const Table& table, const Points& points, double delay_s) {
  Map map{.title = {"hand " + number_text(hand_kg, 2) + " kg, " + number_text(hand_Ns_per_m, 2) + " Ns/m",
                    "delay " + delay_text(delay_s)},
          .x_label = "timestep T (ms)",
          .y_label = "hand's stiffness (N/m)"};
  const std::vector<double> periods = points.grid("period_s");
  for (const double T : periods) map.x.push_back(1e3 * T);
  map.y = points.grid("stiffness_N_per_m");
  map.z.assign(map.x.size() * map.y.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (!points.is_drawn(row, delay_s) || !(points.value(row, "predicted_kg") > 0.0)) continue;
    const auto x = std::ranges::find(periods, points.value(row, "period_s")) - periods.begin();
    const auto y = std::ranges::find(map.y, points.value(row, "stiffness_N_per_m")) - map.y.begin();
    map.z[static_cast<std::size_t>(y) * map.x.size() + static_cast<std::size_t>(x)] = points.value(row, "measured_kg");
  }
  return map;
}

MapChart stability_chart(const Table& table) {
  const Points points(table);
  MapChart chart{.title = stability_answer(table),
                 .subtitle =
                     "Colour: the smallest virtual mass that is stable, found by simulation (order 1, drives of 100 "
                     "Hz); each cell is one grid point, drawn around it",
                 .note = "Grey: no mass up to 1000 kg is stable.",
                 .z_label = "mass (kg)",
                 .z_least = 1e-2,
                 .columns = 3,
                 .panel_height = 300,
                 .x_ticks = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0},
                 .y_ticks = {100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0}};
  if (points.grid("period_s").empty()) return chart;
  const std::vector<double> delays = drawn_delays(points);
  chart.columns = static_cast<int>(delays.size());
  for (const double delay : delays) {
    Map map = map_of(table, points, delay);
    const Enough enough = enough_of(table, delay);
    if (enough.mass_kg > 0.0) {
      map.notes.push_back({1e3 * enough.period_s, enough.up_to_N_per_m, limit_text(enough), Note::Side::below});
    }
    chart.maps.push_back(map);
  }
  return chart;
}

struct Compared {
  double sensitivity, error;
};

// The relative difference between measured and predicted mass that a test permits.
constexpr double tolerance = 0.02;

struct Agreement {
  std::vector<Compared> good, ill;
  Compared worst{0.0, -1.0};
};

Agreement agreement_of(const Table& table) {
  const Points points(table);
  Agreement all;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double p = points.value(row, "predicted_kg"), m = points.value(row, "measured_kg");
    if (!(p > 0.0) || !std::isfinite(m)) continue;
    const Compared one{points.value(row, "sensitivity"), std::abs(m / p - 1.0)};
    if (!(one.sensitivity < well_conditioned)) {
      all.ill.push_back(one);
      continue;
    }
    all.good.push_back(one);
    if (one.error > all.worst.error) all.worst = one;
  }
  return all;
}

// Returns n if one of n points is to be drawn.
std::size_t thinning(std::size_t points) { return points / 2500 + 1; }

Chart agreement_chart(const Table& table) {
  const Agreement all = agreement_of(table);
  // Points beyond these borders are drawn at the borders.
  constexpr double least_x = 1e-4, most_x = 9.0, least_y = 2e-7;
  const auto thin = thinning(all.good.size());
  const auto dots = [&](const std::vector<Compared>& list, const std::string& name, int style, std::size_t each) {
    Curve curve{.name = name, .style = style, .marks = true, .line = false, .mark_size = 0.4};
    for (std::size_t i = 0; i < list.size(); i += each) {
      curve.x.push_back(std::clamp(list[i].sensitivity, least_x, most_x));
      curve.y.push_back(100.0 * std::max(list[i].error, least_y));
    }
    return curve;
  };
  const std::string drawn = thin > 1 ? " (1 in " + std::to_string(thin) + " is drawn)" : "";
  Panel panel{
      .x_label = "by how much a change of the hand's stiffness moves it, |∂ln M/∂ln K|",
      .y_label = "|measured/predicted − 1| (%)",
      .log_x = true,
      .log_y = true,
      .curves = {dots(all.good, count_text(static_cast<double>(all.good.size())) + " points compared" + drawn, 0, thin),
                 dots(all.ill,
                      count_text(static_cast<double>(all.ill.size())) +
                          " too sensitive to compare (right of the line; beyond 10 at its end)",
                      2, 1)},
      .x_low = 7e-5,
      .x_high = 10.0,
      .y_low = 1e-5,
      .y_high = 100.0,
      .y_ticks = {1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0},
      .levels = {{100.0 * tolerance, "tolerance " + number_text(100.0 * tolerance, 2) + " %"}},
      .uprights = {{well_conditioned, ""}}};
  if (all.worst.error >= least_y) {
    panel.notes.push_back({std::max(all.worst.sensitivity, least_x), 100.0 * all.worst.error,
                           "most: " + number_text(100.0 * all.worst.error, 2) + " %"});
  }
  return {.title = agreement_answer(table),
          .subtitle = "Smallest stable mass: measured by simulation, predicted by eigenvalues",
          .panel_height = 360,
          .panels = {panel},
          .key = true};
}

}  // namespace

std::string stability_answer(const Table& table) {
  std::vector<Enough> limits;
  for (const double delay : drawn_delays(Points(table))) {
    const Enough enough = enough_of(table, delay);
    if (enough.mass_kg > 0.0) limits.push_back(enough);
  }
  if (limits.empty()) return "Which mass is stable";
  std::string list;
  for (const Enough& limit : limits) list += (list.empty() ? "" : ", ") + limit_text(limit);
  return "The longer the delay, the softer must the hand be in which a mass is stable: up to " + list +
         " (dots; timestep " + milliseconds(limits.back().period_s) + ")";
}

std::string agreement_answer(const Table& table) {
  const Agreement all = agreement_of(table);
  if (all.good.empty()) return "No point's measured and predicted smallest mass could be compared";
  return "Measured and predicted smallest mass differ by at most " + number_text(100.0 * all.worst.error, 2) +
         " % at " + count_text(static_cast<double>(all.good.size())) + " points";
}

std::vector<std::string> draw_stability(const Table& table, const std::filesystem::path& out) {
  std::vector<std::string> warnings;
  for (const std::string& warning : {draw(stability_chart(table), out / "stability.svg"),
                                     draw(agreement_chart(table), out / "stability_agreement.svg")}) {
    if (!warning.empty()) warnings.push_back(warning);
  }
  return warnings;
}

}  // namespace proxarm::studies
