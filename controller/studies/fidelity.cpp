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

constexpr std::array<double, 3> limits{0.05, 0.1, 0.25};
constexpr std::array<double, 13> frequencies_Hz{0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0};

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
  const auto add = [&](double mass, double period, double drive, bool wall, bool looks_ahead = false) {
    list.push_back({.mass_kg = mass,
                    .period_s = period,
                    .drive_factor = drive,
                    .wall = wall,
                    .looks_ahead = looks_ahead,
                    .settling_s = settling(mass),
                    .duration_s = quick ? 10.0 : 30.0,
                    .sines = sines(wall)});
  };
  add(4.0, 1e-3, 1.0, false);
  add(4.0, 1e-3, 1.0, true);
  add(10.0, 1e-3, 1.0, false);
  add(10.0, 1e-3, 1.0, false, true);
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
  add(4.0, 1e-3, 1.0, false, true);
  add(4.0, 1e-3, 1.0, true, true);
  add(20.0, 1e-3, 1.0, false, true);
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

std::string percent(double share) {
  std::array<char, 20> text{};
  std::snprintf(text.data(), text.size(), "%g %%", 100.0 * share);
  return text.data();
}

// Up to which frequency the error stays below a limit: between two that were measured, on the straight line through
// their logarithms. Below 0.3 Hz only a few periods are measured. 0: not even there.
double band_Hz(const std::map<double, double>& error_of_Hz, double limit) {
  constexpr double lowest_Hz = 0.3;
  double before_Hz = 0.0, before = 0.0;
  for (const auto& [f, error] : error_of_Hz) {
    if (f < lowest_Hz) continue;
    if (error > limit) {
      if (before_Hz == 0.0) return 0.0;
      const double share = std::log(limit / before) / std::log(error / before);
      return before_Hz * std::pow(f / before_Hz, share);
    }
    before_Hz = f;
    before = error;
  }
  return before_Hz;
}

std::string label(const Table& table, std::size_t row) {
  const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
  char text[100];
  std::snprintf(text, sizeof text, "%g kg, T = %g ms%s%s", value("mass_kg"), 1e3 * value("period_s"),
                value("drive_factor") < 1.0 ? ", slow drives" : "", value("lookahead") != 0.0 ? ", lookahead" : "");
  return text;
}

}  // namespace

std::vector<Column> Fidelity::columns() const {
  return {{"wall"},    {"mass_kg"},  {"period_s"},     {"drive_factor"}, {"lookahead"},  {"frequency_Hz"},
          {"force_N"}, {"travel_m"}, {"mass_real_kg"}, {"mass_imag_kg"}, {"mass_error"}, {"stiffness_N_per_m"}};
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
    rows.push_back({setup.wall ? 1.0 : 0.0, setup.mass_kg, setup.period_s, setup.drive_factor,
                    setup.looks_ahead ? 1.0 : 0.0, f, whole ? std::abs(force) : nan_value,
                    whole ? std::abs(travel) : nan_value, whole ? mass.real() : nan_value,
                    whole ? mass.imag() : nan_value, whole ? std::abs(mass - setup.mass_kg) / setup.mass_kg : nan_value,
                    whole ? std::abs(force / travel) : nan_value});
  }
  return rows;
}

json Fidelity::headline(const Table& table, const Options& /*options*/) const {
  const auto value = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
  json of_default, by_setup, bands, width;
  std::map<std::string, std::map<double, double>> errors;
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
      errors[label(table, row)][value(row, "frequency_Hz")] = value(row, "mass_error");
      if (table.job(row) == 0) of_default[frequency] = value(row, "mass_error");
    } else {
      width[label(table, row)][frequency] = value(row, "stiffness_N_per_m");
    }
  }
  for (const auto& [name, error_of_Hz] : errors) {
    for (const double limit : limits) bands[name][percent(limit)] = band_Hz(error_of_Hz, limit);
  }
  return {
      {"apparent_mass_error", of_default},
      {"apparent_mass_error_by_setup", by_setup},
      {"band_Hz", bands},
      {"wall_stiffness_N_per_m", width},
      {"ended_by_fault", ended},
      {"keys",
       {{"apparent_mass_error", "by frequency in Hz: |F/a - M|/M at 4 kg, T = 1 ms in free motion of the default cell"},
        {"apparent_mass_error_by_setup",
         "the same for other masses, timesteps and drives (slow drives: half as fast), and with --lookahead auto"},
        {"band_Hz", "up to which frequency, from 0.3 Hz on, |F/a - M|/M is at most so much"},
        {"wall_stiffness_N_per_m", "by frequency: |F/x| of the handle while the hand leans on the wall"},
        {"ended_by_fault", "rows without a figure because a fault ended their session"}}}};
}

std::vector<std::string> Fidelity::plot(const Table& table, const Options& /*options*/,
                                        const std::filesystem::path& out) const {
  const auto value = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
  Chart chart{.title = "What the hand feels at the simulated arm",
              .columns = 2,
              .panel_width = 640,
              .panel_height = 460,
              .common_key = true};
  Panel mass{.title = "Free motion: mass felt over wanted (below 0 it pulls)",
             .x_label = "frequency (Hz)",
             .y_label = "Re(F/a)/M",
             .log_x = true,
             .y_low = -2.0,
             .y_high = 3.0};
  Panel phase{.title = "Free motion: phase (above 0 the arm does work on the hand)",
              .x_label = "frequency (Hz)",
              .y_label = "arg(F/a) (degrees)",
              .log_x = true,
              .y_low = -180.0,
              .y_high = 180.0};
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
  std::map<std::size_t, std::array<Curve, 3>> curves;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (!std::isfinite(value(row, "force_N"))) continue;
    std::array<Curve, 3>& of_job = curves[table.job(row)];
    for (Curve& curve : of_job) {
      curve.name = label(table, row);
      curve.marks = true;
      curve.x.push_back(value(row, "frequency_Hz"));
    }
    const bool at_wall = value(row, "wall") != 0.0;
    of_job[0].y.push_back(at_wall ? value(row, "stiffness_N_per_m")
                                  : value(row, "mass_real_kg") / value(row, "mass_kg"));
    of_job[1].y.push_back(value(row, "mass_error"));
    of_job[2].y.push_back(180.0 / std::numbers::pi *
                          std::atan2(value(row, "mass_imag_kg"), value(row, "mass_real_kg")));
  }
  std::map<std::string, int> styles;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto found = curves.find(table.job(row));
    if (found == curves.end()) continue;
    // Drives of half the speed feel the same, to some tenths of a per cent: they aren't drawn.
    if (value(row, "drive_factor") == 1.0) {
      auto& [felt, of_error, of_phase] = found->second;
      const int style = styles.emplace(felt.name, static_cast<int>(styles.size())).first->second;
      felt.style = of_error.style = of_phase.style = style;
      if (value(row, "wall") != 0.0) {
        wall.curves.push_back(felt);
      } else {
        mass.curves.push_back(felt);
        error.curves.push_back(of_error);
        phase.curves.push_back(of_phase);
      }
    }
    curves.erase(found);
  }
  chart.panels = {error, mass, phase, wall};
  const std::string warning = draw(chart, out / "fidelity.svg");
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Fidelity::text(const json& headline) const {
  std::ostringstream text;
  for (const auto& item : headline.at("apparent_mass_error_by_setup").items()) {
    std::array<char, 60> word{};
    text << "error of the mass felt, " << item.key() << ":";
    for (const double limit : limits) {
      const double band = headline.at("band_Hz").at(item.key()).at(percent(limit)).get<double>();
      std::snprintf(word.data(), word.size(), "%s at most %s up to %.2g Hz", limit == limits[0] ? "" : ",",
                    percent(limit).c_str(), band);
      text << word.data();
    }
    std::map<double, double> sorted;
    for (const auto& each : item.value().items()) sorted[std::stod(each.key())] = each.value().get<double>();
    const char* before = "\n  ";
    for (const auto& [f, e] : sorted) {
      std::snprintf(word.data(), word.size(), "%s%g Hz %.3g %%", before, f, 100.0 * e);
      text << word.data();
      before = ", ";
    }
    text << "\n";
  }
  return text.str();
}

}  // namespace proxarm::studies
