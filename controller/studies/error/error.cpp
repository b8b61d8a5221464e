#include "controller/studies/error/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/proxies/admittance_proxy.hpp"
#include "controller/studies/common/chart.hpp"
#include "controller/studies/error/error_cases.hpp"
#include "controller/studies/error/error_methods.hpp"
#include "controller/studies/error/error_runs.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/world/world.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Vec3;
using nlohmann::json;

// The rate at which (26) changes the speed of a frictionless slide around a sphere, 1/s, and the predicted T f_n/(M R).
// Speed is lost inside of a sphere and gained outside.
json energy_rate(bool inside) {
  constexpr double R = 0.1, M = 1.0, T = 1e-3, speed = 0.2, push = 5.0;
  std::vector<models::World::Entry> entries;
  entries.push_back({std::make_unique<models::Sphere>(models::PointCore{Vec3::Zero()}, R, 0.0, inside), 0, 0});
  models::World world(std::move(entries));
  AdmittanceProxy<3> proxy({.mass_kg = M, .period_s = T}, world);
  const double toward = inside ? 1.0 : -1.0;  // the push, onto the surface
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

// A case's two panels.
struct CasePanels {
  Panel by_time, by_step;
};

// What they show of an error: from where rounding begins to a decimetre, above which a method fails.
constexpr double least_error_m = 1.2e-10, greatest_error_m = 0.1;

CasePanels panels_of(const ErrorCase& which) {
  const Panel panel{.title = which.title,
                    .y_label = "rms error (m)",
                    .log_x = true,
                    .log_y = true,
                    .y_low = 1e-10,
                    .y_high = greatest_error_m};
  CasePanels panels{panel, panel};
  panels.by_time.x_label = "run time (µs)";
  panels.by_step.x_label = "timestep (ms)";
  return panels;
}

void add_ours(const Runs& ours, const std::string& name, int style, CasePanels& panels) {
  Curve time{.name = name, .style = style, .marks = true};
  Curve step = time;
  for (std::size_t i = 0; i < ours.T.size(); ++i) {
    const double e = std::max(ours.error[i].median, least_error_m);
    time.x.push_back(1e-3 * ours.cost_ns[i]);
    time.y.push_back(e);
    step.x.push_back(1e3 * ours.T[i]);
    step.y.push_back(e);
  }
  panels.by_time.curves.push_back(time);
  panels.by_step.curves.push_back(step);
}

// The least error of each key: the envelope over a method's tunings.
using Envelope = std::map<double, double>;

void note(Envelope& envelope, double key, double error) {
  const auto [place, is_new] = envelope.emplace(key, error);
  if (!is_new) place->second = std::min(place->second, error);
}

void add_rival(const std::vector<Runs>& list, Method method, const std::string& name, CasePanels& panels) {
  Envelope by_time, by_step;  // by twentieths of a decade of run time; by timestep
  for (const Runs& runs : list) {
    if (runs.method != method_names[method]) continue;
    for (std::size_t i = 0; i < runs.T.size(); ++i) {
      note(by_time, std::round(20.0 * std::log10(runs.cost_ns[i])) / 20.0, runs.error[i].median);
      note(by_step, runs.T[i], runs.error[i].median);
    }
  }
  Curve time{.name = name, .style = method};
  Curve step = time;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [x, e] : by_time) {
    least = std::min(least, e);
    if (!(least < greatest_error_m)) continue;
    time.x.push_back(1e-3 * std::pow(10.0, x));
    time.y.push_back(std::max(least, least_error_m));
  }
  for (const auto& [x, e] : by_step) {
    if (!(e < greatest_error_m)) continue;
    step.x.push_back(1e3 * x);
    step.y.push_back(std::max(e, least_error_m));
  }
  panels.by_time.curves.push_back(time);
  panels.by_step.curves.push_back(step);
}

void add_fixed(const Runs& one, Panel& by_time) {
  Curve time{.name = "one penalty for all cases", .style = 7, .marks = true};
  for (std::size_t i = 0; i < one.T.size(); ++i) {
    if (!(one.error[i].median < greatest_error_m)) continue;
    time.x.push_back(1e-3 * one.cost_ns[i]);
    time.y.push_back(std::max(one.error[i].median, least_error_m));
  }
  by_time.curves.push_back(time);
}

// Of a case's panels: where steps of 1 ms are.
void mark_1_ms(const std::vector<Runs>& list, CasePanels& panels) {
  Curve time{.name = "at 1 ms", .style = 6, .marks = true, .line = false};
  Curve step = time;
  for (const char* method : {"1", "2"}) {
    const Runs& ours = runs_of(list, method);
    const std::size_t i = ours.at_1_ms();
    const double e = std::max(ours.error[i].median, least_error_m);
    time.x.push_back(1e-3 * ours.cost_ns[i]);
    time.y.push_back(e);
    step.x.push_back(1.0);
    step.y.push_back(e);
  }
  panels.by_time.curves.push_back(time);
  panels.by_step.curves.push_back(step);
}

constexpr std::array<const char*, method_count> method_titles{
    "(26)",    "(26), order 2", "penalty, semi-implicit Euler", "penalty, Runge-Kutta", "penalty, implicit Euler",
    "ROS rule"};

// Of a method on a case: the run with steps of 1 ms whose tuning errs least there.
struct AtOneMs {
  double error_m = std::numeric_limits<double>::infinity(), step_ns = 0.0;
};
AtOneMs at_1_ms(const std::vector<Runs>& list, const std::string& method) {
  AtOneMs best;
  for (const Runs& runs : list) {
    if (runs.method != method) continue;
    const std::size_t i = runs.at_1_ms();
    if (runs.error[i].median < best.error_m) best = {runs.error[i].median, runs.cost_ns[i] / runs.steps[i]};
  }
  return best;
}

// In how many motions order 2 needs less time for the same error than whatever is best of the others.
std::string work_answer(const RunsByCase& all) {
  int faster = 0;
  for (const auto& [name, list] : all) {
    if (speedup_over_tuned(runs_of(list, method_names[order_2]), list).median > 1.0) ++faster;
  }
  char title[160];
  std::snprintf(title, sizeof title,
                "For the same error order 2 takes less time than the best tuned penalty in %d of %zu motions", faster,
                all.size());
  return title;
}

// What order 2 errs by where it errs most, and the penalty method that does best by that measure.
std::string glance_answer(const RunsByCase& all) {
  const auto worst_um = [&all](Method method) {
    double worst_m = 0.0;
    for (const auto& [name, list] : all) worst_m = std::max(worst_m, at_1_ms(list, method_names[method]).error_m);
    return 1e6 * worst_m;
  };
  char title[160];
  std::snprintf(
      title, sizeof title, "At 1 ms order 2 is within %.3g µm in every motion, the best penalty method within %.3g µm",
      worst_um(order_2), std::min({worst_um(penalty_euler), worst_um(penalty_rk4), worst_um(penalty_implicit)}));
  return title;
}

// The motions side by side, a mark for each method.
Chart at_a_glance(const RunsByCase& all) {
  Panel error{.title = "Position error with steps of 1 ms, each method tuned to the motion (at the bottom: rounding)",
              .y_label = "rms error (m)",
              .log_y = true,
              .y_low = 1e-10,
              .y_high = greatest_error_m};
  Panel time{.title = "Time of such a step", .y_label = "ns", .log_y = true};
  for (std::size_t method = 0; method < method_count; ++method) {
    Curve of_error{.name = method_titles[method], .style = static_cast<int>(method), .marks = true, .line = false};
    Curve of_time = of_error;
    double x = 0.0;
    for (const ErrorCase& which : error_cases()) {
      const auto found = all.find(which.name);
      if (found == all.end()) continue;
      const AtOneMs at = at_1_ms(found->second, method_names[method]);
      const double place = x + 0.11 * (static_cast<double>(method) - 2.5);
      x += 1.0;
      if (!(at.error_m < greatest_error_m)) continue;
      of_error.x.push_back(place);
      of_error.y.push_back(std::max(at.error_m, least_error_m));
      of_time.x.push_back(place);
      of_time.y.push_back(at.step_ns);
    }
    error.curves.push_back(of_error);
    time.curves.push_back(of_time);
  }
  for (const ErrorCase& which : error_cases()) {
    if (!all.contains(which.name)) continue;
    error.x_names.push_back(which.name);
    std::ranges::replace(error.x_names.back(), '_', ' ');
  }
  time.x_names = error.x_names;
  return {.title = glance_answer(all),
          .panel_width = 1500,
          .panel_height = 430,
          .panels = {error, time},
          .common_key = true};
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
      const AtOneMs at = at_1_ms(list, method);
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
  const RunsByCase all = collect(table);
  const Fixed fixed = best_fixed(all);
  Chart work{.title = work_answer(all), .columns = 2, .panel_width = 640, .panel_height = 420, .common_key = true};
  Chart order = work;
  order.title = "Position error against timestep";
  for (const ErrorCase& which : error_cases()) {
    const auto found = all.find(which.name);
    if (found == all.end()) continue;
    const std::vector<Runs>& list = found->second;
    CasePanels panels = panels_of(which);
    for (const Method method : {order_1, order_2}) {
      add_ours(runs_of(list, method_names[method]), method_titles[method], method, panels);
    }
    for (const Method method : {penalty_euler, penalty_rk4, penalty_implicit, ros}) {
      add_rival(list, method, method_titles[method], panels);
    }
    if (const Runs* one = fixed_runs(list, fixed); one != nullptr) add_fixed(*one, panels.by_time);
    mark_1_ms(list, panels);
    work.panels.push_back(panels.by_time);
    order.panels.push_back(panels.by_step);
  }
  std::vector<std::string> warnings;
  Chart glance = at_a_glance(all);
  for (const auto& [chart, file] :
       {std::pair{&work, "error.svg"}, std::pair{&order, "error_order.svg"}, std::pair{&glance, "error_at_1ms.svg"}}) {
    const std::string warning = draw(*chart, out / file);
    if (!warning.empty()) warnings.push_back(warning);
  }
  return warnings;
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
