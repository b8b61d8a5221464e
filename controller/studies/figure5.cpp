#include "controller/studies/figure5.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "controller/proxies/impedance_proxy.hpp"
#include "controller/studies/common/chart.hpp"
#include "models/surfaces/friction_plane.hpp"

namespace proxarm::studies {
namespace {

using controller::ImpedanceLaw;
using controller::ImpedanceProxy;
using models::Vec;
using nlohmann::json;
using Vec2 = Vec<2>;

struct Law {
  const char* name;  // the paper's number
  ImpedanceLaw law;
};
constexpr std::array<Law, 3> laws{
    {{"1", ImpedanceLaw::plain}, {"5", ImpedanceLaw::damped_motion}, {"23", ImpedanceLaw::implicit}}};

constexpr double above_m = 0.015, below_m = -0.020, rub_m = 0.03;
constexpr double press_from_s = 0.3, press_to_s = 0.6, rub_from_s = 1.4, rub_to_s = 3.6, leave_from_s = 4.2,
                 leave_to_s = 4.4;

double minimum_jerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

// The hand presses, rubs to and fro twice, and leaves.
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
  constexpr int finer = 50;  // steps of the mechanics in a period
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
      // From well after the touch until the rubbing: the hand rests, and so should the force.
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

std::vector<std::string> Figure5::plot(const Table& table, const Options& options,
                                       const std::filesystem::path& out) const {
  const std::size_t law = table.column("law"), time = table.column("time_s");
  const json told = headline(table, options);
  const auto newtons = [&told](const char* key, const char* which) { return told.at(key).at(which).get<double>(); };
  constexpr double nothing_N = 1e-3;
  const bool neither = newtons("oscillation_N", "23") < nothing_N && newtons("pull_force_N", "23") < nothing_N;
  char title[160];
  std::snprintf(title, sizeof title, "At rest (1) swings by %.3g N, on leaving (5) pulls with %.3g N; (23) does %s",
                newtons("oscillation_N", "1"), newtons("pull_force_N", "5"), neither ? "neither" : "one of these, too");
  Chart chart{.title = title, .columns = 3, .panel_width = 560, .panel_height = 250, .panels = {}};
  struct Quantity {
    const char *column, *label;
    double factor, low, high;
  };
  const std::array<Quantity, 4> quantities{{{"tool_x_m", "p_x (mm)", 1e3, -35, 35},
                                            {"tool_y_m", "p_y (mm)", 1e3, -15, 25},
                                            {"force_x_N", "f_x (N)", 1.0, -3, 3},
                                            {"force_y_N", "f_y (N)", 1.0, -2, 10}}};
  for (const Quantity& quantity : quantities) {
    const std::size_t column = table.column(quantity.column);
    for (const Law& each : laws) {
      Curve curve;
      for (std::size_t row = 0; row < table.rows(); ++row) {
        if (table.text(row, law) != each.name) continue;
        // Points that couldn't be told apart at half the size aren't drawn.
        const double t = table.number(row, time), value = quantity.factor * table.number(row, column);
        const bool moved =
            !curve.x.empty() && std::abs(value - curve.y.back()) > 0.004 * (quantity.high - quantity.low);
        if (!curve.x.empty() && !moved && t - curve.x.back() < 0.05) continue;
        curve.x.push_back(t);
        curve.y.push_back(value);
      }
      chart.panels.push_back({.title = &quantity == &quantities[0] ? "(" + std::string(each.name) + ")" : "",
                              .x_label = &quantity == &quantities[3] ? "time (s)" : "",
                              .y_label = quantity.label,
                              .curves = {curve},
                              .key = false,
                              .x_low = 0.0,
                              .x_high = 5.0,
                              .y_low = quantity.low,
                              .y_high = quantity.high});
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
