#include "controller/extras/studies/fidelity_bands.hpp"

#include <cmath>
#include <cstdio>

#include "controller/extras/studies/common/chart_page.hpp"

namespace proxarm::studies {

double band_Hz(const std::map<double, double>& error_of_Hz, double limit) {
  double before_Hz = 0.0, before = 0.0;
  for (const auto& [f, error] : error_of_Hz) {
    if (f < lowest_band_Hz) continue;
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

std::string band_text(const std::map<double, double>& error_of_Hz, double limit) {
  const double band = band_Hz(error_of_Hz, limit);
  if (!(band > 0.0)) return "at no frequency from " + number_text(lowest_band_Hz, 2) + " Hz on";
  if (band == error_of_Hz.rbegin()->first) return "up to " + number_text(band, 2) + " Hz, the highest measured";
  return "up to " + number_text(band, 2) + " Hz";
}

std::string percent_text(double share) {
  char text[20];
  std::snprintf(text, sizeof text, "%g %%", 100.0 * share);
  return text;
}

bool is_turning(const Table& table, std::size_t row) { return table.number(row, table.column("inertia_kg_m2")) != 0.0; }

std::string fidelity_label(const Table& table, std::size_t row) {
  const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
  const bool turning = is_turning(table, row);
  const std::string& cell = table.text(row, table.column("cell"));
  char text[100];
  std::snprintf(text, sizeof text, "%s%s%g %s, T = %g ms%s%s%s", cell == "default" ? "" : cell.c_str(),
                cell == "default" ? "" : ", ", value(turning ? "inertia_kg_m2" : "mass_kg"), turning ? "kg m²" : "kg",
                1e3 * value("period_s"), value("drive_factor") < 1.0 ? ", slow drives" : "",
                value("lookahead") != 0.0 ? ", lookahead" : "", value("torque") != 0.0 ? " and torque" : "");
  return text;
}

}  // namespace proxarm::studies
