#include "controller/studies/error/tool_error.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "controller/proxies/pose_proxy.hpp"
#include "controller/studies/common/chart.hpp"
#include "controller/studies/error/error_runs.hpp"
#include "controller/studies/error/tool_cases.hpp"
#include "models/rigid/rigid_world.hpp"

namespace proxarm::studies {
namespace {

using controller::PoseProxy;
using nlohmann::json;

constexpr std::array step_counts{60, 120, 240, 480, 960, 1920, 3840, 7680};
constexpr int steps_of_1_ms = 960;

struct ToolRun {
  double place_m = 0.0, turn_rad = 0.0;  // rms
  int unresolved = 0;
};

controller::PoseConfig config_of(const ToolCase& which, double period_s) {
  return {.mass_kg = which.mass_kg, .inertia_kg_m2 = which.inertia_kg_m2, .period_s = period_s};
}

void begin(const ToolCase& which, PoseProxy& proxy, double t_0) {
  const ToolState at = which.exact(t_0);
  proxy.start(at.pose, t_0);
  proxy.resume(at.pose, at.velocity - 0.5 * proxy.config().period_s * at.acceleration);
}

ToolRun run_from(const ToolCase& which, const models::PoseAlgorithm& world, int steps, double t_0) {
  const std::unique_ptr<models::PoseAlgorithm> g = world.clone();
  const double T = tool_case_s / steps;
  PoseProxy proxy(config_of(which, T), *g);
  begin(which, proxy, t_0);
  ToolRun run;
  double place = 0.0, turn = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double t = t_0 + k * T;
    if (proxy.step(proxy.predict(which.hand(t))) != controller::ProxyFault::none) {
      return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 0};
    }
    run.unresolved += g->unresolved() ? 1 : 0;
    const models::Twist off = models::difference(proxy.q(), which.exact(t + T).pose);
    place += off.head<3>().squaredNorm() / steps;
    turn += off.tail<3>().squaredNorm() / steps;
  }
  run.place_m = std::sqrt(place);
  run.turn_rad = std::sqrt(turn);
  return run;
}

// The least of some rounds.
double step_ns(const ToolCase& which, const models::PoseAlgorithm& world, int steps) {
  const double T = tool_case_s / steps;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 9; ++round) {
    const std::unique_ptr<models::PoseAlgorithm> g = world.clone();
    PoseProxy proxy(config_of(which, T), *g);
    begin(which, proxy, 0.0);
    const auto begun = std::chrono::steady_clock::now();
    for (int k = 0; k < steps; ++k) static_cast<void>(proxy.step(proxy.predict(which.hand(k * T))));
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - begun;
    least = std::min(least, took.count() / steps);
  }
  return least;
}

}  // namespace

std::vector<Column> ToolErrorStudy::columns() const {
  return {{"case", true},
          {"steps"},
          {"period_s"},
          {"place_error_m"},
          {"place_error_high_m"},
          {"turn_error_rad"},
          {"turn_error_high_rad"},
          {"unresolved"},
          {"step_ns"}};
}

std::size_t ToolErrorStudy::jobs(const Options& /*options*/) const { return tool_cases().size(); }

std::vector<Row> ToolErrorStudy::run(std::size_t job, const Options& options) const {
  const ToolCase which = tool_cases()[job];
  const models::RigidWorld world(which.tool, which.objects);
  const int phases = options.quick ? 3 : 20;
  const double ns = step_ns(which, world, steps_of_1_ms);
  std::vector<Row> rows;
  for (const int steps : step_counts) {
    if (options.quick && steps > 2 * steps_of_1_ms) continue;
    const double T = tool_case_s / steps;
    std::vector<double> place, turn;
    int unresolved = 0;
    for (int i = 0; i < phases; ++i) {
      const ToolRun run = run_from(which, world, steps, T * (i + 0.5) / phases);
      place.push_back(run.place_m);
      turn.push_back(run.turn_rad);
      unresolved += run.unresolved;
    }
    const Spread of_place = Spread::of(place), of_turn = Spread::of(turn);
    rows.push_back({which.name, static_cast<double>(steps), T, of_place.median, of_place.high, of_turn.median,
                    of_turn.high, static_cast<double>(unresolved), ns});
  }
  return rows;
}

json ToolErrorStudy::headline(const Table& table, const Options& /*options*/) const {
  json cases;
  for (const ToolCase& which : tool_cases()) {
    Runs place, turn;
    double unresolved = 0.0, ns = 0.0;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.text(row, table.column("case")) != which.name) continue;
      const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
      const auto add = [&](Runs& runs, const char* median, const char* high) {
        runs.T.push_back(value("period_s"));
        runs.steps.push_back(value("steps"));
        runs.error.push_back({value(median), value(median), value(high)});
      };
      add(place, "place_error_m", "place_error_high_m");
      add(turn, "turn_error_rad", "turn_error_high_rad");
      unresolved += value("unresolved");
      ns = value("step_ns");
    }
    if (place.T.empty()) continue;
    cases[which.name] = {{"title", which.title},
                         {"place_error_at_1_ms_m", place.error[place.at_1_ms()].median},
                         {"turn_error_at_1_ms_rad", turn.error[turn.at_1_ms()].median},
                         {"place_order", fit_order(place).order},
                         {"turn_order", fit_order(turn).order},
                         {"unresolved", unresolved},
                         {"step_us", 1e-3 * ns}};
  }
  return {
      {"cases", cases},
      {"keys",
       {{"cases",
         "by motion: rms errors with steps of 1 ms, the power of T by which they fall (0: they are rounding), steps "
         "of all runs that found no forces, and the time of a step of 1 ms"}}}};
}

namespace {

// How far a tool is from its exact motion at 1 ms, where that is most.
std::string error_answer(const Table& table) {
  double place_m = 0.0, turn_rad = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (std::abs(table.number(row, table.column("period_s")) - 1e-3) > 1e-4) continue;
    place_m = std::max(place_m, table.number(row, table.column("place_error_m")));
    turn_rad = std::max(turn_rad, table.number(row, table.column("turn_error_rad")));
  }
  char title[160];
  std::snprintf(title, sizeof title, "At 1 ms a rigid tool is within %.2g µm and %.2g mrad (rms) of its exact motion",
                1e6 * place_m, 1e3 * turn_rad);
  return title;
}

}  // namespace

std::vector<std::string> ToolErrorStudy::plot(const Table& table, const Options& /*options*/,
                                              const std::filesystem::path& out) const {
  constexpr double least = 1.2e-10;
  Panel place{.title = "Place of the reference point (at the bottom: exact)",
              .x_label = "timestep (ms)",
              .y_label = "rms error (m)",
              .log_x = true,
              .log_y = true,
              .x_low = 0.1,
              .x_high = 20.0,
              .y_low = 1e-10,
              .y_high = 1e-2};
  Panel turn = place;
  turn.title = "Orientation";
  turn.y_label = "rms error (rad)";
  int style = 0;
  for (const ToolCase& which : tool_cases()) {
    Curve of_place{.name = which.title, .style = style++, .marks = true};
    Curve of_turn = of_place;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.text(row, table.column("case")) != which.name) continue;
      const auto value = [&](const char* name) { return table.number(row, table.column(name)); };
      of_place.x.push_back(1e3 * value("period_s"));
      of_turn.x.push_back(1e3 * value("period_s"));
      of_place.y.push_back(std::max(value("place_error_m"), least));
      of_turn.y.push_back(std::max(value("turn_error_rad"), least));
    }
    place.curves.push_back(of_place);
    turn.curves.push_back(of_turn);
  }
  const std::string warning = draw({.title = error_answer(table),
                                    .columns = 2,
                                    .panel_width = 640,
                                    .panel_height = 460,
                                    .panels = {place, turn},
                                    .common_key = true},
                                   out / "error_tools.svg");
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string ToolErrorStudy::text(const json& headline) const {
  std::string text = "motion   place at 1 ms   order   turn at 1 ms   order   step\n";
  for (const auto& item : headline.at("cases").items()) {
    const auto number = [&](const char* key) { return item.value().at(key).get<double>(); };
    char line[160];
    std::snprintf(line, sizeof line, "%-8s %11.2g m %7.2f %10.2g rad %7.2f %6.2g µs\n", item.key().c_str(),
                  number("place_error_at_1_ms_m"), number("place_order"), number("turn_error_at_1_ms_rad"),
                  number("turn_order"), number("step_us"));
    text += line;
  }
  return text;
}

}  // namespace proxarm::studies
