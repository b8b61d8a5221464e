#include "controller/extras/studies/figure5.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/proxies/impedance_proxy.hpp"
#include "models/surfaces/friction_plane.hpp"

namespace proxarm::studies {
namespace {

using controller::ImpedanceLaw;
using controller::ImpedanceProxy;
using models::Vec;
using nlohmann::json;
using Vec2 = Vec<2>;

struct Law {
  const char *name, *title;  // the paper's number of the equation; the title in the picture
  ImpedanceLaw law;
};
constexpr std::array<Law, 3> laws{{{"1", "spring alone", ImpedanceLaw::plain},
                                   {"5", "spring and damper", ImpedanceLaw::damped_motion},
                                   {"23", "implicit, default", ImpedanceLaw::implicit}}};

// A smaller force counts as 0.
constexpr double nothing_N = 1e-3;

constexpr double above_m = 0.015, below_m = -0.020, rub_m = 0.03;
constexpr double press_from_s = 0.3, press_to_s = 0.6, rub_from_s = 1.4, rub_to_s = 3.6, leave_from_s = 4.2,
                 leave_to_s = 4.4;

double minimum_jerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

// Returns the hand's intended position: the hand presses, rubs to and fro twice, and leaves.
Vec2 intention(double t) {
  const double down = minimum_jerk((t - press_from_s) / (press_to_s - press_from_s));
  const double up = minimum_jerk((t - leave_from_s) / (leave_to_s - leave_from_s));
  Vec2 x;
  x.y() = above_m + (below_m - above_m) * (down - up);
  const double s = (t - rub_from_s) / (rub_to_s - rub_from_s);
  x.x() = s > 0.0 && s < 1.0 ? rub_m * std::sin(4.0 * std::numbers::pi * s) : 0.0;
  return x;
}

Vec2 intended_velocity(double t) {
  constexpr double h = 1e-6;
  return (intention(t + h) - intention(t - h)) / (2.0 * h);
}

}  // namespace

std::vector<Column> Figure5::columns() const {
  return {{"law", true},    {"time_s"},    {"tool_x_m"},  {"tool_y_m"},  {"measured_x_m"},
          {"measured_y_m"}, {"proxy_x_m"}, {"proxy_y_m"}, {"force_x_N"}, {"force_y_N"}};
}

std::size_t Figure5::jobs(const Options& /*options*/) const { return laws.size(); }

std::vector<Row> Figure5::run(std::size_t job, const Options& /*options*/) const {
  const Figure5Setup setup;
  const double T = setup.period_s, m = setup.device_mass_kg;
  models::FrictionPlane<2> wall(Vec2::Zero(), Vec2::UnitY(), setup.friction);
  ImpedanceProxy<2> proxy({setup.stiffness_N_per_m, setup.damping_Ns_per_m, T, laws[job].law}, wall);
  Vec2 x = intention(0.0), v = Vec2::Zero(), measured = x;
  proxy.start(x);
  const double smoothing = 1.0 - std::exp(-2.0 * std::numbers::pi * setup.filter_Hz * T);
  std::vector<Row> rows;
  const auto steps = static_cast<int>(std::lround(setup.duration_s / T));
  constexpr int finer = 50;  // steps in which the device's motion is integrated over a period
  for (int k = 0; k < steps; ++k) {
    measured += smoothing * (x - measured);
    if (proxy.step(measured) != controller::ProxyFault::none) break;
    const Vec2 f = proxy.f();
    rows.push_back({std::string(laws[job].name), k * T, x.x(), x.y(), measured.x(), measured.y(), proxy.q().x(),
                    proxy.q().y(), f.x(), f.y()});
    for (int i = 0; i < finer; ++i) {  // semi-implicit Euler
      const double t = (k + (i + 0.5) / finer) * T, h = T / finer;
      const Vec2 hand =
          setup.hand_stiffness_N_per_m * (intention(t) - x) + setup.hand_damping_Ns_per_m * (intended_velocity(t) - v);
      v += h / m * (f + hand);
      x += h * v;
    }
  }
  return rows;
}

json Figure5::headline(const Table& table, const Options& /*options*/) const {
  const Figure5Setup setup;
  const std::size_t law = table.column("law"), time = table.column("time_s"), fx = table.column("force_x_N"),
                    fy = table.column("force_y_N");
  json pull, kick, oscillation;
  for (const Law& each : laws) {
    double most_pull = 0.0, most_kick = 0.0, touch_s = -1.0, low = 0.0, high = 0.0;
    bool any = false;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.text(row, law) != each.name) continue;
      const double f_x = table.number(row, fx), f_y = table.number(row, fy), t = table.number(row, time);
      most_pull = std::max(most_pull, -f_y);
      most_kick = std::max(most_kick, std::abs(f_x) - setup.friction * f_y);
      if (touch_s < 0.0 && f_y > 0.0) touch_s = t;
      // From well after the touch until the rubbing begins the hand rests, and the force should be steady.
      if (t < press_to_s + 0.3 || t > rub_from_s - 0.05) continue;
      low = any ? std::min(low, f_y) : f_y;
      high = any ? std::max(high, f_y) : f_y;
      any = true;
    }
    pull[each.name] = most_pull;
    kick[each.name] = most_kick;
    oscillation[each.name] = high - low;
  }
  return {{"pull_force_N", pull},
          {"kick_N", kick},
          {"oscillation_N", oscillation},
          {"setup",
           {{"friction", setup.friction},
            {"period_s", setup.period_s},
            {"stiffness_N_per_m", setup.stiffness_N_per_m},
            {"damping_Ns_per_m", setup.damping_Ns_per_m},
            {"filter_Hz", setup.filter_Hz},
            {"device_mass_kg", setup.device_mass_kg},
            {"hand_stiffness_N_per_m", setup.hand_stiffness_N_per_m},
            {"hand_damping_Ns_per_m", setup.hand_damping_Ns_per_m}}},
          {"keys",
           {{"pull_force_N", "by law: the greatest force towards the wall, max(-f_y, 0)"},
            {"kick_N", "by law: the greatest max(|f_x| - mu f_y, 0): force outside the friction cone"},
            {"oscillation_N", "by law: f_y from peak to peak while the hand rests on the wall, 0.3 s after the press"},
            {"setup", "what was simulated; device mass and hand are chosen here, the rest is the paper's"}}}};
}

namespace {

// A row of the picture, which shows one signal for each law.
struct Signal {
  const char *column, *label;
  double factor, low, high, tick;
  double from_s = 0.0, to_s = 5.0;
};
constexpr std::array<Signal, 5> signals{{{"tool_x_m", "p_x (mm)", 1e3, -40, 40, 30},
                                         {"tool_y_m", "p_y (mm)", 1e3, -20, 30, 20},
                                         {"force_x_N", "f_x (N)", 1.0, -4, 4, 3},
                                         {"force_y_N", "f_y (N)", 1.0, -2, 16, 5},
                                         {"force_y_N", "f_y (N)", 1.0, -0.7, 0.7, 0.5, 4.1, 4.7}}};

// Returns a signal over time for one law. Points that couldn't be told apart even at half the picture's size are left
// out.
Curve curve_of(const Table& table, const Law& law, const Signal& signal) {
  const std::size_t of = table.column("law"), time = table.column("time_s"), column = table.column(signal.column);
  Curve curve;
  double last_t = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double t = table.number(row, time), value = signal.factor * table.number(row, column);
    if (table.text(row, of) != law.name || t < signal.from_s || t > signal.to_s) continue;
    const bool moved = !curve.x.empty() && std::abs(value - curve.y.back()) > 0.004 * (signal.high - signal.low);
    if (!curve.x.empty() && !moved && t - last_t < 0.01 * (signal.to_s - signal.from_s)) continue;
    curve.x.push_back(t);
    curve.y.push_back(value);
    last_t = t;
  }
  return curve;
}

// Returns a note at the least force while the tool leaves the wall. If that force is below 0, the wall pulls.
Note pull_note(const Curve& f_y) {
  const auto least = std::ranges::min_element(f_y.y);
  if (least == f_y.y.end()) return {};
  const double t = f_y.x[static_cast<std::size_t>(least - f_y.y.begin())];
  if (!(*least < -nothing_N)) return {4.5, 0.35, "no pull", Note::Side::on, false};
  return {t, *least, "pull " + number_text(-*least, 3) + " N", Note::Side::right};
}

// Returns a note that states by how much the force swings while the hand rests.
Note swing_note(double oscillation_N, const Curve& f_y) {
  const double t = 0.5 * (press_to_s + 0.3 + rub_from_s);
  if (oscillation_N < nothing_N) return {t + 0.4, 6.0, "steady", Note::Side::on, false};
  const double most = f_y.y.empty() ? 0.0 : *std::ranges::max_element(f_y.y);
  return {2.5, most + 3.0, "swings by " + number_text(oscillation_N, 3) + " N", Note::Side::on, false};
}

Panel panel_of(const Signal& signal, const Curve& curve) {
  const bool enlarged = &signal == &signals.back();
  Panel panel{.x_label = enlarged ? "time (s)" : "",
              .y_label = signal.label,
              .curves = {curve},
              .x_low = signal.from_s,
              .x_high = signal.to_s,
              .y_low = signal.low,
              .y_high = signal.high,
              .x_ticks = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0},
              .y_ticks = {-signal.tick, 0.0, signal.tick}};
  if (signal.high > 2.0 * signal.tick) panel.y_ticks = {0.0, signal.tick, 2.0 * signal.tick};
  if (enlarged) panel.x_ticks = {4.2, 4.4, 4.6};
  panel.x_spans = {{press_from_s, press_to_s, ""}, {rub_from_s, rub_to_s, ""}, {leave_from_s, leave_to_s, ""}};
  if (enlarged) panel.x_spans = {{leave_from_s, leave_to_s, ""}};
  return panel;
}

}  // namespace

std::string figure5_answer(const json& headline) {
  const auto newtons = [&headline](const char* key, const char* which) {
    return headline.at(key).at(which).get<double>();
  };
  const auto does = [](double N, const std::string& what, const std::string& what_not) {
    return N > nothing_N ? what + number_text(N, 3) + " N" : what_not;
  };
  const bool neither = newtons("oscillation_N", "23") < nothing_N && newtons("pull_force_N", "23") < nothing_N;
  return "Resting on the wall, (1) " + does(newtons("oscillation_N", "1"), "swings by ", "is steady") +
         "; on leaving it, (5) " + does(newtons("pull_force_N", "5"), "pulls with ", "doesn't pull") + "; (23) does " +
         (neither ? "neither" : "one of these, too");
}

std::vector<std::string> Figure5::plot(const Table& table, const Options& options,
                                       const std::filesystem::path& out) const {
  const json told = headline(table, options);
  Chart chart{.title = figure5_answer(told),
              .subtitle = "p: the tool, f: the force on it; x along the wall, y off it. Shaded: press, rub, leave",
              .columns = 3,
              .panel_height = 100};
  for (const Signal& signal : signals) {
    for (const Law& each : laws) {
      const Curve curve = curve_of(table, each, signal);
      Panel panel = panel_of(signal, curve);
      if (&signal == &signals.front()) {
        panel.title = "(" + std::string(each.name) + ") " + each.title;
        panel.x_spans[0].text = "press";
        panel.x_spans[1].text = "rub";
        panel.x_spans[2].text = "leave";
      }
      if (&signal == &signals[3]) {
        panel.notes = {swing_note(told.at("oscillation_N").at(each.name).get<double>(), curve)};
      }
      if (&signal == &signals.back()) {
        panel.title = "leaving, enlarged";
        panel.notes = {pull_note(curve)};
      }
      chart.panels.push_back(panel);
    }
  }
  const std::string warning = draw(chart, out / "figure5.svg");
  return warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning};
}

std::string Figure5::text(const json& headline) const {
  std::string text = "law    pull on leaving    kick at stick to slip    oscillation at touch\n";
  for (const Law& each : laws) {
    char line[160];
    std::snprintf(line, sizeof line, "%-5s %10.3g N %18.3g N %20.3g N\n", ("(" + std::string(each.name) + ")").c_str(),
                  headline.at("pull_force_N").at(each.name).get<double>(),
                  headline.at("kick_N").at(each.name).get<double>(),
                  headline.at("oscillation_N").at(each.name).get<double>());
    text += line;
  }
  return text;
}

}  // namespace proxarm::studies
