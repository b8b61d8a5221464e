#include "controller/extras/studies/error/tool_error.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/error/error_runs.hpp"
#include "controller/extras/studies/error/tool_cases.hpp"
#include "controller/proxies/pose_proxy.hpp"
#include "models/rigid/rigid_world.hpp"

namespace proxarm::studies {
namespace {

using controller::PoseProxy;
using nlohmann::json;

constexpr std::array step_counts{60, 120, 240, 480, 960, 1920, 3840, 7680};
constexpr int steps_of_1_ms = 960;

struct ToolRun {
  double place_m = 0.0, turn_rad = 0.0;  // rms over the steps
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

// Returns the time of a step, as the least of several rounds.
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

// The largest error at the timestep nearest to 1 ms, and the motion with that error.
struct WorstTool {
  double period_s = 0.0, error = 0.0;
  std::string motion{};
};

WorstTool worst_tool(const Table& table, const char* error) {
  WorstTool worst;
  const std::size_t period = table.column("period_s");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double T = table.number(row, period);
    if (std::abs(T - 1e-3) < std::abs(worst.period_s - 1e-3)) worst.period_s = T;
  }
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double e = table.number(row, table.column(error));
    if (table.number(row, period) != worst.period_s || !(e > worst.error)) continue;
    worst.error = e;
    worst.motion = table.text(row, table.column("case"));
  }
  return worst;
}

std::string motion_title(const std::string& name) {
  for (const ToolCase& which : tool_cases()) {
    if (which.name == name) return which.title;
  }
  return name;
}

// Errors below least_tool_error are rounding, and are drawn at drawn_least.
constexpr double least_tool_error = 1e-10, drawn_least = 2.5e-12, tool_bottom = 1e-12;

Panel tool_panel(const Table& table, const char* error, const char* title, const char* unit) {
  Panel panel{.title = title,
              .x_label = "timestep (ms)",
              .y_label = std::string("rms error (") + unit + ")",
              .log_x = true,
              .log_y = true,
              .x_low = 0.1,
              .x_high = 20.0,
              .y_low = tool_bottom,
              .y_high = 1.0,
              .x_ticks = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0},
              .y_ticks = {1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0},
              .y_spans = {{tool_bottom, least_tool_error, "rounding"}}};
  int style = 0;
  for (const ToolCase& which : tool_cases()) {
    // The first curve's marks are larger, because other curves may lie on that curve.
    Curve curve{.name = which.title, .style = style, .marks = true, .mark_size = style == 0 ? 1.5 : 0.9};
    ++style;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.text(row, table.column("case")) != which.name) continue;
      const double e = table.number(row, table.column(error));
      curve.x.push_back(1e3 * table.number(row, table.column("period_s")));
      curve.y.push_back(e < least_tool_error ? drawn_least : e);
    }
    panel.curves.push_back(curve);
  }
  const WorstTool worst = worst_tool(table, error);
  panel.uprights = {{1e3 * worst.period_s, ""}};
  if (worst.error > least_tool_error) {
    const bool turns = std::string(unit) == "rad";
    panel.notes = {{1e3 * worst.period_s, worst.error,
                    number_text((turns ? 1e3 : 1e6) * worst.error, 2) + (turns ? " mrad" : " µm"), Note::Side::above}};
  }
  return panel;
}

}  // namespace

std::string tool_error_answer(const Table& table) {
  const WorstTool place = worst_tool(table, "place_error_m"), turn = worst_tool(table, "turn_error_rad");
  const bool same = place.motion == turn.motion;
  return "At " + number_text(1e3 * place.period_s, 2) + " ms a rigid tool is within " +
         number_text(1e6 * place.error, 2) + " µm and " + number_text(1e3 * turn.error, 2) +
         " mrad (rms) of its exact motion; worst: " + motion_title(place.motion) +
         (same ? "" : " (place), " + motion_title(turn.motion) + " (orientation)");
}

std::vector<std::string> ToolErrorStudy::plot(const Table& table, const Options& /*options*/,
                                              const std::filesystem::path& out) const {
  Chart chart{.title = tool_error_answer(table), .columns = 2, .panel_height = 330, .key = true};
  chart.panels = {tool_panel(table, "place_error_m", "Place of the reference point", "m"),
                  tool_panel(table, "turn_error_rad", "Orientation", "rad")};
  const std::string warning = draw(chart, out / "error_tools.svg");
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
