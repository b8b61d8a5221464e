#include "controller/studies/fidelity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "controller/studies/common/chart.hpp"

namespace proxarm::studies {
namespace {

using nlohmann::json;
using Complex = std::complex<double>;

constexpr std::array<double, 13> frequencies_Hz{0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0};

// At low frequencies as much travel as a hand takes, above a velocity of 5 cm/s each.
std::vector<ArmSine> sines(bool wall) {
  std::vector<ArmSine> list;
  for (const double f : frequencies_Hz) {
    const double amplitude = std::min(wall ? 1e-3 : 0.012, 0.05 / (2.0 * std::numbers::pi * f));
    list.push_back({f, amplitude});
  }
  return list;
}

std::vector<ArmSetup> setups(bool quick) {
  std::vector<ArmSetup> list;
  // The transient of the start fades with the time constant 2M/D, D = 13 Ns/m (a hand's 20 Ns/m without what the loop's
  // lag takes away). Every mass gets 12 of them, since at 0.1 Hz a tenth of a newton counts.
  const auto settling = [quick](double mass) { return std::max(quick ? 3.0 : 12.0, (quick ? 0.6 : 2.0) * mass); };
  const auto add = [&](double mass, double period, double drive, bool wall) {
    list.push_back({.mass_kg = mass,
                    .period_s = period,
                    .drive_factor = drive,
                    .wall = wall,
                    .settling_s = settling(mass),
                    .duration_s = quick ? 10.0 : 30.0,
                    .sines = sines(wall)});
  };
  add(4.0, 1e-3, 1.0, false);
  add(4.0, 1e-3, 1.0, true);
  add(10.0, 1e-3, 1.0, false);
  if (quick) return list;
  add(2.0, 1e-3, 1.0, false);
  add(20.0, 1e-3, 1.0, false);
  add(4.0, 2e-3, 1.0, false);
  add(4.0, 4e-3, 1.0, false);
  add(4.0, 2e-3, 1.0, true);
  add(4.0, 4e-3, 1.0, true);
  add(4.0, 1e-3, 0.5, false);
  add(4.0, 1e-3, 0.5, true);
  add(10.0, 1e-3, 0.5, false);
  return list;
}

Complex coefficient(const std::vector<double>& x, double frequency_Hz, double period_s) {
  const double step = 2.0 * std::numbers::pi * frequency_Hz * period_s;
  Complex sum = 0.0;
  double mean = 0.0;
  for (const double value : x) mean += value / static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - mean) * std::polar(1.0, -step * static_cast<double>(i));
  return 2.0 * sum / static_cast<double>(x.size());
}

std::string label(const Table& table, std::size_t row) {
  const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
  char text[100];
  std::snprintf(text, sizeof text, "%g kg, T = %g ms%s", value("mass_kg"), 1e3 * value("period_s"),
                value("drive_factor") < 1.0 ? ", slow drives" : "");
  return text;
}

}  // namespace

std::vector<Column> Fidelity::columns() const {
  return {{"wall"},     {"mass_kg"},      {"period_s"},     {"drive_factor"}, {"frequency_Hz"},     {"force_N"},
          {"travel_m"}, {"mass_real_kg"}, {"mass_imag_kg"}, {"mass_error"},   {"stiffness_N_per_m"}};
}

std::size_t Fidelity::jobs(const Options& options) const { return setups(options.quick).size(); }

std::vector<Row> Fidelity::run(std::size_t job, const Options& options) const {
  const ArmSetup setup = setups(options.quick)[job];
  const std::vector<ArmSample> samples = arm_(setup);
  const auto wanted = static_cast<std::size_t>(std::lround(setup.duration_s / setup.period_s));
  const bool whole = samples.size() >= wanted;
  std::vector<double> F, x;
  for (const ArmSample& sample : samples) {
    if (F.size() == wanted) break;
    F.push_back(sample.hand_force_N.x());
    x.push_back(sample.tool_m.x());
  }
  std::vector<Row> rows;
  for (const double f : frequencies_Hz) {
    const double omega = 2.0 * std::numbers::pi * f;
    const Complex force = coefficient(F, f, setup.period_s), travel = coefficient(x, f, setup.period_s);
    const Complex mass = force / (-omega * omega * travel);
    const double nan_value = std::nan("");
    rows.push_back({setup.wall ? 1.0 : 0.0, setup.mass_kg, setup.period_s, setup.drive_factor, f,
                    whole ? std::abs(force) : nan_value, whole ? std::abs(travel) : nan_value,
                    whole ? mass.real() : nan_value, whole ? mass.imag() : nan_value,
                    whole ? std::abs(mass - setup.mass_kg) / setup.mass_kg : nan_value,
                    whole ? std::abs(force / travel) : nan_value});
  }
  return rows;
}

json Fidelity::headline(const Table& table, const Options& /*options*/) const {
  const auto value = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
  json of_default, by_setup, width;
  std::int64_t ended = 0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    char frequency[20];
    std::snprintf(frequency, sizeof frequency, "%g", value(row, "frequency_Hz"));
    if (!std::isfinite(value(row, "force_N"))) {
      ++ended;
      continue;
    }
    if (value(row, "wall") == 0.0) {
      by_setup[label(table, row)][frequency] = value(row, "mass_error");
      if (table.job(row) == 0) of_default[frequency] = value(row, "mass_error");
    } else {
      width[label(table, row)][frequency] = value(row, "stiffness_N_per_m");
    }
  }
  return {
      {"apparent_mass_error", of_default},
      {"apparent_mass_error_by_setup", by_setup},
      {"wall_stiffness_N_per_m", width},
      {"ended_by_fault", ended},
      {"keys",
       {{"apparent_mass_error", "by frequency in Hz: |F/a - M|/M at 4 kg, T = 1 ms in free motion of the default cell"},
        {"apparent_mass_error_by_setup", "the same for other masses, timesteps and drives (slow drives: half as fast)"},
        {"wall_stiffness_N_per_m", "by frequency: |F/x| of the handle while the hand leans on the wall"},
        {"ended_by_fault", "rows without a figure because a fault ended their session"}}}};
}

std::vector<std::string> Fidelity::plot(const Table& table, const Options& /*options*/,
                                        const std::filesystem::path& out) const {
  const auto value = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
  Chart chart{.title = "What the hand feels at the simulated arm", .panel_width = 1100, .panel_height = 400};
  Panel mass{.title = "Free motion: mass felt",
             .x_label = "frequency (Hz)",
             .y_label = "Re(F/a) (kg)",
             .log_x = true,
             .log_y = true,
             .y_low = 0.5,
             .y_high = 100.0};
  Panel error{.title = "Free motion: error against the wanted mass",
              .x_label = "frequency (Hz)",
              .y_label = "|F/a − M|/M",
              .log_x = true,
              .log_y = true,
              .y_low = 1e-3,
              .y_high = 10.0};
  Panel wall{.title = "Against a wall: stiffness felt",
             .x_label = "frequency (Hz)",
             .y_label = "|F/x| (N/m)",
             .log_x = true,
             .log_y = true};
  std::map<std::size_t, std::array<Curve, 2>> curves;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (!std::isfinite(value(row, "force_N"))) continue;
    std::array<Curve, 2>& two = curves[table.job(row)];
    for (Curve& curve : two) {
      curve.name = label(table, row);
      curve.style = static_cast<int>(table.job(row));
      curve.marks = true;
      curve.x.push_back(value(row, "frequency_Hz"));
    }
    const bool at_wall = value(row, "wall") != 0.0;
    two[0].y.push_back(at_wall ? value(row, "stiffness_N_per_m") : value(row, "mass_real_kg"));
    two[1].y.push_back(value(row, "mass_error"));
  }
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto found = curves.find(table.job(row));
    if (found == curves.end()) continue;
    if (value(row, "wall") != 0.0) {
      wall.curves.push_back(found->second[0]);
    } else {
      mass.curves.push_back(found->second[0]);
      error.curves.push_back(found->second[1]);
    }
    curves.erase(found);
  }
  chart.panels = {mass, error, wall};
  const std::string warning = draw(chart, out / "fidelity.svg");
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Fidelity::text(const json& headline) const {
  std::ostringstream text;
  for (const auto& item : headline.at("apparent_mass_error_by_setup").items()) {
    text << "error of the mass felt, " << item.key() << ":\n ";
    std::map<double, double> sorted;
    for (const auto& each : item.value().items()) sorted[std::stod(each.key())] = each.value().get<double>();
    for (const auto& [f, e] : sorted) {
      char word[60];
      std::snprintf(word, sizeof word, " %g Hz %.2g %%,", f, 100.0 * e);
      text << word;
    }
    text << "\n";
  }
  return text.str();
}

}  // namespace proxarm::studies
