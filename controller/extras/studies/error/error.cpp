#include "controller/extras/studies/error/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/extras/studies/error/error_cases.hpp"
#include "controller/extras/studies/error/error_methods.hpp"
#include "controller/extras/studies/error/error_plot.hpp"
#include "controller/extras/studies/error/error_runs.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/world/world.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Vec3;
using nlohmann::json;

// Returns the rate at which (26) changes the speed of a frictionless slide around a sphere, 1/s, and the predicted rate
// T f_n/(M R). On the inside of a sphere the slide loses speed; on the outside it gains speed.
json energy_rate(bool inside) {
  constexpr double R = 0.1, M = 1.0, T = 1e-3, speed = 0.2, push = 5.0;
  std::vector<models::World::Entry> entries;
  entries.push_back({std::make_unique<models::Sphere>(models::PointCore{Vec3::Zero()}, R, 0.0, inside), 0, 0});
  models::World world(std::move(entries));
  AdmittanceProxy<3> proxy({.mass_kg = M, .period_s = T}, world);
  const double toward = inside ? 1.0 : -1.0;  // sign of the push that presses the proxy onto the surface
  proxy.start({.q = R * Vec3::UnitX(),
               .v = speed * Vec3::UnitY(),
               .a = -speed * speed / R * Vec3::UnitX(),
               .contact_established = true});
  constexpr int steps = 500;
  double f_n = 0.0, first = 0.0;
  for (int k = 0; k < steps; ++k) {
    static_cast<void>(proxy.step(toward * push * proxy.q().normalized()));
    if (k == 0) first = proxy.velocity().norm();
    f_n += proxy.f().norm() / steps;
  }
  const double measured = std::log(proxy.velocity().norm() / first) / ((steps - 1) * T);
  const double predicted = (inside ? -1.0 : 1.0) * T * f_n / (M * R);
  return {{"measured_per_s", measured}, {"predicted_per_s", predicted}};
}

json of_tuning(const std::string& method, const Tuning& tuning) {
  return {{"method", method},
          {"stiffness_N_per_m", tuning.stiffness_N_per_m},
          {"damping_ratio", tuning.damping_ratio},
          {"friction_slope", tuning.friction_slope},
          {"staggered", tuning.staggered}};
}

json of_spread(const Spread& spread) { return {{"median", spread.median}, {"low", spread.low}, {"high", spread.high}}; }

}  // namespace

std::vector<Column> ErrorStudy::columns() const {
  return {{"case", true},
          {"method", true},
          {"stiffness_N_per_m"},
          {"damping_ratio"},
          {"friction_slope"},
          {"staggered"},
          {"period_s"},
          {"steps"},
          {"reference_step_ns"},
          {"of_reference"},
          {"of_reference_low"},
          {"of_reference_high"},
          {"position_error_m"},
          {"position_error_low_m"},
          {"position_error_high_m"},
          {"velocity_error_m_per_s"},
          {"force_error_N"},
          {"energy_error_J"},
          {"stop_error_s"}};
}

std::size_t ErrorStudy::jobs(const Options& /*options*/) const { return error_cases().size() * method_count; }

std::vector<Row> ErrorStudy::run(std::size_t job, const Options& options) const {
  const ErrorCase which = error_cases()[job / method_count];
  const auto method = static_cast<Method>(job % method_count);
  std::vector<Row> rows;
  for (const Tuning& tuning : tunings(which, method, options.quick)) {
    for (const MethodRun& run : run_method(which, method, tuning, options.quick)) {
      const Errors& e = run.errors;
      rows.push_back({which.name, std::string(method_names[method]), tuning.stiffness_N_per_m, tuning.damping_ratio,
                      tuning.friction_slope, tuning.staggered ? 1.0 : 0.0, run.period_s, static_cast<double>(run.steps),
                      run.reference_ns, run.of_reference.median, run.of_reference.low, run.of_reference.high,
                      e.position_m, run.position_low_m, run.position_high_m, e.velocity_m_per_s, e.force_N, e.energy_J,
                      e.stop_s});
    }
  }
  return rows;
}

json ErrorStudy::headline(const Table& table, const Options& /*options*/) const {
  const RunsByCase all = collect(table);
  const Fixed fixed = best_fixed(all);
  json order, residual, tuned, against_fixed, best, one_ms;
  for (const auto& [name, list] : all) {
    for (const char* method : {"1", "2"}) {
      const Runs& ours = runs_of(list, method);
      const Fit fit = fit_order(ours);
      order[name][method] = fit.order;
      residual[name][method] = fit.residual;
      tuned[name][method] = of_spread(speedup_over_tuned(ours, list));
      const Runs* one = fixed_runs(list, fixed);
      against_fixed[name][method] = of_spread(one == nullptr ? Spread{} : speedup_over(ours, *one));
    }
    const Runs& winner = best_tuned(list);
    best[name] = of_tuning(winner.method, winner.tuning);
    best[name]["order"] = fit_order(winner).order;
    for (const char* method : method_names) {
      const AtOneMs at = best_at_1_ms(list, method);
      one_ms[name][method] = {{"position_error_m", std::isfinite(at.error_m) ? json(at.error_m) : json()},
                              {"step_ns", at.step_ns}};
    }
  }
  return {
      {"order", order},
      {"order_residual_decades", residual},
      {"speedup_over_tuned_penalty", tuned},
      {"speedup_over_fixed_penalty", against_fixed},
      {"tuned_penalty", best},
      {"fixed_penalty", of_tuning(fixed.method, fixed.tuning)},
      {"at_1_ms", one_ms},
      {"energy_rate", {{"concave", energy_rate(true)}, {"convex", energy_rate(false)}}},
      {"keys",
       {{"order", "by case and method: fitted slope of log error over log T; 0 where all errors are rounding"},
        {"order_residual_decades", "rms of the fit's residual, in decades of error"},
        {"speedup_over_tuned_penalty",
         "by case and method: run time of the best-tuned other method over ours at equal position error (of nine in "
         "ten phases), median over errors of 1 um to 1 mm that both reach; low and high by how step times scatter; 0 "
         "where there is none"},
        {"speedup_over_fixed_penalty", "the same against one method and tuning for all cases (fixed_penalty)"},
        {"tuned_penalty", "what was best at 0.1 mm"},
        {"at_1_ms", "position error (median over phases) and time of a step with steps of 1 ms, least over tunings"},
        {"energy_rate", "d ln(speed)/dt of (26) on a sphere of 0.1 m at 1 kg, 1 ms, and T f_n/(M R)"}}}};
}

std::vector<std::string> ErrorStudy::plot(const Table& table, const Options& /*options*/,
                                          const std::filesystem::path& out) const {
  return draw_errors(table, out);
}

std::string ErrorStudy::text(const json& headline) const {
  std::ostringstream text;
  char line[200];
  std::snprintf(line, sizeof line, "%-14s %15s %28s %28s\n", "", "order (residual)", "faster than tuned",
                "than one for all");
  text << line;
  const auto spread = [&](const char* key, const std::string& name, const char* method) {
    const json& item = headline.at(key).at(name).at(method);
    char words[64];
    std::snprintf(words, sizeof words, "%.3g (%.3g to %.3g)", item.at("median").get<double>(),
                  item.at("low").get<double>(), item.at("high").get<double>());
    return std::string(words);
  };
  for (const auto& item : headline.at("order").items()) {
    for (const char* method : {"1", "2"}) {
      std::snprintf(line, sizeof line, "%-14s %s %6.2f (%.2f) %28s %28s\n", item.key().c_str(),
                    method[0] == '1' ? "(26)   " : "order 2", item.value().at(method).get<double>(),
                    headline.at("order_residual_decades").at(item.key()).at(method).get<double>(),
                    spread("speedup_over_tuned_penalty", item.key(), method).c_str(),
                    spread("speedup_over_fixed_penalty", item.key(), method).c_str());
      text << line;
    }
  }
  const json& fixed = headline.at("fixed_penalty");
  text << "one for all: " << fixed.at("method").get<std::string>() << ", " << fixed.at("stiffness_N_per_m")
       << " N/m, damping ratio " << fixed.at("damping_ratio")
       << (fixed.at("staggered").get<bool>() ? ", staggered" : "") << "\n";
  for (const char* side : {"concave", "convex"}) {
    std::snprintf(line, sizeof line, "(26) on %s curvature: speed %+.4f /s, T f_n/(M R) %+.4f /s\n", side,
                  headline.at("energy_rate").at(side).at("measured_per_s").get<double>(),
                  headline.at("energy_rate").at(side).at("predicted_per_s").get<double>());
    text << line;
  }
  return text.str();
}

}  // namespace proxarm::studies
