#include "controller/extras/studies/fidelity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string_view>

#include "controller/extras/studies/fidelity_bands.hpp"
#include "controller/extras/studies/fidelity_plot.hpp"

namespace proxarm::studies {
namespace {

using nlohmann::json;
using Complex = std::complex<double>;

constexpr std::array<double, 13> frequencies_Hz{0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0};

// Returns the sines of the hand's motion. At low frequencies their amplitude is as large as a hand's travel can be; at
// higher ones it gives 5 cm/s for each sine. For a light arm the amplitudes are halved, so that the hand's force during
// the tare is small enough for the arm's drives.
std::vector<ArmSine> sines(bool wall, bool light) {
  std::vector<ArmSine> list;
  for (const double f : frequencies_Hz) {
    const double amplitude = std::min(wall ? 1e-3 : 0.012, 0.05 / (2.0 * std::numbers::pi * f));
    list.push_back({f, light ? 0.5 * amplitude : amplitude});
  }
  return list;
}

// Returns the sines of the hand's rotation. At low frequencies their amplitude is as large as a wrist can turn; at
// higher ones it gives 0.1 rad/s for each sine.
std::vector<ArmSine> turning_sines() {
  std::vector<ArmSine> list;
  for (const double f : frequencies_Hz) list.push_back({f, std::min(0.05, 0.1 / (2.0 * std::numbers::pi * f))});
  return list;
}

std::vector<ArmSetup> setups(bool quick) {
  std::vector<ArmSetup> list;
  // The transient at the start decays with the time constant 2M/D, where D = 13 Ns/m is the hand's 20 Ns/m less what
  // the loop's delay takes away. Each mass has 12 time constants to settle, because a tenth of a newton matters at 0.1
  // Hz.
  const auto settling = [quick](double mass) { return std::max(quick ? 3.0 : 12.0, (quick ? 0.6 : 2.0) * mass); };
  const auto add = [&](double mass, double period, double drive, bool wall, bool looks_ahead = false,
                       const char* cell = "default", bool torque = false) {
    list.push_back({.cell = cell,
                    .mass_kg = mass,
                    .period_s = period,
                    .drive_factor = drive,
                    .wall = wall,
                    .looks_ahead = looks_ahead,
                    .torque = torque,
                    .settling_s = settling(mass),
                    .duration_s = quick ? 10.0 : 30.0,
                    .sines = sines(wall, std::string_view(cell) != "default")});
  };
  add(4.0, 1e-3, 1.0, false);
  add(4.0, 1e-3, 1.0, true);
  add(10.0, 1e-3, 1.0, false);
  add(10.0, 1e-3, 1.0, false, true);
  // For a tool that turns, the time constant is 2J/D, which is below 2 s with the 0.5 Nms/rad of the hand's wrist.
  const auto turn = [&](double inertia, double period, double drive) {
    list.push_back({.inertia_kg_m2 = inertia,
                    .period_s = period,
                    .drive_factor = drive,
                    .settling_s = quick ? 3.0 : 24.0,
                    .duration_s = quick ? 10.0 : 30.0,
                    .sines = turning_sines()});
  };
  turn(0.1, 1e-3, 1.0);
  if (quick) return list;
  for (const char* cell : {"cobot", "seven"}) {
    for (const bool looks_ahead : {false, true}) add(10.0, 1e-3, 1.0, false, looks_ahead, cell);
    add(10.0, 1e-3, 1.0, false, true, cell, true);
  }
  for (const double mass : {1.0, 4.0, 10.0}) add(mass, 1e-3, 1.0, false, true, "default", true);
  for (const double inertia : {0.05, 0.2, 0.3}) turn(inertia, 1e-3, 1.0);
  turn(0.1, 2e-3, 1.0);
  turn(0.1, 1e-3, 0.5);
  add(2.0, 1e-3, 1.0, false);
  add(20.0, 1e-3, 1.0, false);
  add(4.0, 2e-3, 1.0, false);
  add(6.0, 4e-3, 1.0, false);  // 4 kg would oscillate at this timestep
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

constexpr std::array directions{"x", "y", "z"};

const std::string& direction(const Table& table, std::size_t row) { return table.text(row, table.column("along")); }

}  // namespace

std::vector<Column> Fidelity::columns() const {
  return {{"cell", true},
          {"along", true},
          {"wall"},
          {"mass_kg"},
          {"inertia_kg_m2"},
          {"period_s"},
          {"drive_factor"},
          {"lookahead"},
          {"torque"},
          {"frequency_Hz"},
          {"force_N"},
          {"travel_m"},
          {"mass_real_kg"},
          {"mass_imag_kg"},
          {"mass_error"},
          {"stiffness_N_per_m"},
          {"torque_Nm"},
          {"turn_rad"},
          {"inertia_real_kg_m2"},
          {"inertia_imag_kg_m2"},
          {"inertia_error"}};
}

std::size_t Fidelity::jobs(const Options& options) const { return setups(options.quick).size(); }

namespace {

// Adds one row per frequency, with NaN for the results if a fault ended the session.
void add_rows(const ArmSetup& setup, const std::vector<ArmSample>& samples, std::vector<Row>& rows) {
  const auto wanted = static_cast<std::size_t>(std::lround(setup.duration_s / setup.period_s));
  const bool whole = samples.size() >= wanted, turning = setup.turns();
  std::vector<double> F, x;
  for (const ArmSample& sample : samples) {
    if (F.size() == wanted) break;
    F.push_back((turning ? sample.hand_torque_Nm : sample.hand_force_N)[setup.axis]);
    x.push_back((turning ? sample.turn_rad : sample.tool_m)[setup.axis]);
  }
  const double asked = turning ? setup.inertia_kg_m2 : setup.mass_kg;
  for (const double f : frequencies_Hz) {
    const double omega = 2.0 * std::numbers::pi * f;
    const Complex force = coefficient(F, f, setup.period_s), travel = coefficient(x, f, setup.period_s);
    const Complex mass = force / (-omega * omega * travel);
    const std::array felt{
        std::abs(force),         std::abs(travel), mass.real(), mass.imag(), std::abs(mass - asked) / asked,
        std::abs(force / travel)};
    Row row{setup.cell,
            directions[static_cast<std::size_t>(setup.axis)],
            setup.wall ? 1.0 : 0.0,
            setup.mass_kg,
            setup.inertia_kg_m2,
            setup.period_s,
            setup.drive_factor,
            setup.looks_ahead ? 1.0 : 0.0,
            setup.torque ? 1.0 : 0.0,
            f};
    for (const double value : felt) row.emplace_back(whole && !turning ? value : std::nan(""));
    for (std::size_t k = 0; k < 5; ++k) row.emplace_back(whole && turning ? felt[k] : std::nan(""));
    rows.push_back(row);
  }
}

}  // namespace

std::vector<Row> Fidelity::run(std::size_t job, const Options& options) const {
  ArmSetup setup = setups(options.quick)[job];
  std::vector<Row> rows;
  for (setup.axis = 0; setup.axis < (setup.wall ? 1 : 3); ++setup.axis) add_rows(setup, arm_(setup), rows);
  return rows;
}

namespace {

// Collects a quantity by setup and frequency: its value in the worst direction, and its value in each direction.
class WorstOf {
 public:
  // Of the values of all directions, the one furthest from `wanted` is the worst.
  explicit WorstOf(double wanted) : wanted_(wanted) {}
  void add(const std::string& setup, const std::string& along, double frequency_Hz, double figure) {
    std::map<double, double>& worst = worst_[setup];
    const auto [at, is_new] = worst.emplace(frequency_Hz, figure);
    if (!is_new && std::abs(figure - wanted_) > std::abs(at->second - wanted_)) at->second = figure;
    each_[setup][along][frequency_text(frequency_Hz)] = figure;
  }
  [[nodiscard]] const std::map<std::string, std::map<double, double>>& worst() const { return worst_; }
  [[nodiscard]] json worst_json() const {
    json out = json::object();
    for (const auto& [setup, figures] : worst_) {
      for (const auto& [frequency_Hz, figure] : figures) out[setup][frequency_text(frequency_Hz)] = figure;
    }
    return out;
  }
  [[nodiscard]] const json& each_json() const { return each_; }

 private:
  static std::string frequency_text(double frequency_Hz) {
    std::array<char, 20> text{};
    std::snprintf(text.data(), text.size(), "%g", frequency_Hz);
    return text.data();
  }

  double wanted_;
  std::map<std::string, std::map<double, double>> worst_;
  json each_ = json::object();
};

json bands_of(const WorstOf& errors) {
  json bands;
  for (const auto& [name, error_of_Hz] : errors.worst()) {
    for (const double limit : fidelity_limits) bands[name][percent_text(limit)] = band_Hz(error_of_Hz, limit);
  }
  return bands;
}

}  // namespace

json Fidelity::headline(const Table& table, const Options& /*options*/) const {
  const auto value = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
  WorstOf mass(0.0), inertia(0.0), shares(1.0), width(0.0);
  std::int64_t ended = 0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string name = fidelity_label(table, row), &along = direction(table, row);
    const double f = value(row, "frequency_Hz");
    if (!std::isfinite(value(row, is_turning(table, row) ? "torque_Nm" : "force_N"))) {
      ++ended;
    } else if (is_turning(table, row)) {
      inertia.add(name, along, f, value(row, "inertia_error"));
      shares.add(name, along, f, value(row, "inertia_real_kg_m2") / value(row, "inertia_kg_m2"));
    } else if (value(row, "wall") == 0.0) {
      mass.add(name, along, f, value(row, "mass_error"));
    } else {
      width.add(name, along, f, value(row, "stiffness_N_per_m"));
    }
  }
  json bands = bands_of(mass);
  bands.update(bands_of(inertia));
  return {
      {"apparent_mass_error_by_setup", mass.worst_json()},
      {"apparent_mass_error_by_direction", mass.each_json()},
      {"apparent_inertia_error_by_setup", inertia.worst_json()},
      {"apparent_inertia_error_by_direction", inertia.each_json()},
      {"apparent_inertia_over_wanted", shares.worst_json()},
      {"band_Hz", bands},
      {"wall_stiffness_N_per_m", width.worst_json()},
      {"ended_by_fault", ended},
      {"keys",
       {{"apparent_mass_error_by_setup",
         "by frequency in Hz: |F/a - M|/M in free motion, of x, y and z the worst, for masses, timesteps, drives (slow "
         "drives: half as fast), with --lookahead auto, where the gears' torque is measured, and of other cells than "
         "the default one"},
        {"apparent_mass_error_by_direction", "the same along each of x, y and z of W"},
        {"apparent_inertia_error_by_setup",
         "|tau/alpha - J|/J of a tool that is turned with 4 kg, about x, y or z, whichever is worst"},
        {"apparent_inertia_error_by_direction", "the same about each of x, y and z of W"},
        {"apparent_inertia_over_wanted", "Re(tau/alpha)/J, where it is furthest from 1"},
        {"band_Hz",
         "up to which frequency, from 0.3 Hz on, the error of the mass, or of the inertia, is at most so much in every "
         "direction"},
        {"wall_stiffness_N_per_m", "by frequency: |F/x| of the handle while the hand leans on the wall, along x"},
        {"ended_by_fault", "rows without a figure because a fault ended their session"}}}};
}

std::vector<std::string> Fidelity::plot(const Table& table, const Options& /*options*/,
                                        const std::filesystem::path& out) const {
  return draw_fidelity(table, out);
}

namespace {

void add_errors(std::ostringstream& text, const json& headline, const char* of, const char* what) {
  for (const auto& item : headline.at(of).items()) {
    std::array<char, 60> word{};
    text << "error of the " << what << " felt, " << item.key() << ":";
    for (const double limit : fidelity_limits) {
      const double band = headline.at("band_Hz").at(item.key()).at(percent_text(limit)).get<double>();
      std::snprintf(word.data(), word.size(), "%s at most %s up to %.2g Hz", limit == fidelity_limits[0] ? "" : ",",
                    percent_text(limit).c_str(), band);
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
}

}  // namespace

std::string Fidelity::text(const json& headline) const {
  std::ostringstream text;
  add_errors(text, headline, "apparent_mass_error_by_setup", "mass");
  add_errors(text, headline, "apparent_inertia_error_by_setup", "inertia");
  return text.str();
}

}  // namespace proxarm::studies
