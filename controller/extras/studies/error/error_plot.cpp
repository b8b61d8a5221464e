#include "controller/extras/studies/error/error_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "controller/extras/studies/common/chart.hpp"
#include "controller/extras/studies/common/chart_page.hpp"
#include "controller/extras/studies/error/error_cases.hpp"
#include "controller/extras/studies/error/error_methods.hpp"

namespace proxarm::studies {
namespace {

// Errors below rounding_m are drawn at drawn_rounding_m; errors above a metre aren't drawn.
constexpr double rounding_m = 1e-10, drawn_rounding_m = 3e-11, bottom_m = 1e-11, top_m = 1.0;

double drawn_error(double error_m) { return error_m < rounding_m ? drawn_rounding_m : error_m; }

constexpr std::array<const char*, method_count> method_titles{
    "order 1: eq. (26)",  "order 2", "penalty, semi-implicit Euler", "penalty, Runge-Kutta", "penalty, implicit Euler",
    "ROS admittance rule"};

enum Look { look_order_1, look_order_2, look_rival, look_fixed = 7, look_1_ms = 6, look_luck = 4 };

// The quantity over which errors are drawn. Over the run time, the drawn error is the one that nine of ten runs stay
// below; over the timestep, it is the median error.
enum class Over { run_time, timestep };

double x_of(Over over, const Runs& runs, std::size_t i) {
  return over == Over::run_time ? 1e-3 * runs.cost_ns[i] : 1e3 * runs.T[i];
}

double error_of(Over over, const Runs& runs, std::size_t i) {
  return over == Over::run_time ? runs.error[i].high : runs.error[i].median;
}

// Returns the number of coarse runs that are exact by chance. A run counts as such if it is exact while a finer run
// errs by more than ten times rounding. The steps of such a run happen to end where all methods are exact, which says
// nothing about the method.
std::size_t lucky_runs(const Runs& ours, Over over) {
  std::size_t lucky = 0;
  double worst_finer = 0.0;
  for (std::size_t i = ours.T.size(); i-- > 0;) {
    const double error = error_of(over, ours, i);
    if (error < rounding_m && worst_finer > 10.0 * rounding_m) lucky = std::max(lucky, i + 1);
    worst_finer = std::max(worst_finer, error);
  }
  return lucky;
}

void add_point(Curve& curve, double x, double error_m) {
  if (!(error_m < top_m)) return;
  curve.x.push_back(x);
  curve.y.push_back(drawn_error(error_m));
}

void add_ours(const Runs& ours, Method method, Over over, Panel& panel) {
  Curve curve{.name = method_titles[method], .style = method == order_1 ? look_order_1 : look_order_2, .marks = true};
  if (method == order_2) curve.mark_size = 1.3;  // larger, because another curve may lie on this one
  Curve luck{.name = "exact by luck: finer steps err more", .style = look_luck, .marks = true, .line = false};
  const std::size_t lucky = lucky_runs(ours, over);
  for (std::size_t i = 0; i < ours.T.size(); ++i) {
    add_point(i < lucky ? luck : curve, x_of(over, ours, i), error_of(over, ours, i));
  }
  panel.curves.push_back(curve);
  panel.curves.push_back(luck);
}

Curve rival_curve() { return {.name = "best of the others, tuned to the motion", .style = look_rival}; }

// Returns, for each error, the least run time with which one of the other methods keeps below the error, at that run's
// timestep and at all finer ones.
Curve rivals_over_run_time(const std::vector<Runs>& list) {
  Curve curve = rival_curve();
  for (double error = 0.5 * top_m; error > 0.5 * rounding_m; error *= std::pow(10.0, -0.1)) {
    double least_ns = std::numeric_limits<double>::infinity();
    for (const Runs& runs : list) {
      if (is_penalty(runs)) least_ns = std::min(least_ns, runs.cost(error));
    }
    if (std::isfinite(least_ns)) add_point(curve, 1e-3 * least_ns, error);
  }
  return curve;
}

Curve rivals_over_timestep(const std::vector<Runs>& list) {
  std::map<double, double> least;
  for (const Runs& runs : list) {
    if (!is_penalty(runs)) continue;
    for (std::size_t i = 0; i < runs.T.size(); ++i) {
      const auto [place, is_new] = least.emplace(runs.T[i], runs.error[i].median);
      if (!is_new) place->second = std::min(place->second, runs.error[i].median);
    }
  }
  Curve curve = rival_curve();
  for (const auto& [T, error] : least) add_point(curve, 1e3 * T, error);
  return curve;
}

Curve fixed_curve(const Runs& one, const Fixed& fixed) {
  Curve curve{
      .name = "the best of them with one setting for all: " + count_text(fixed.tuning.stiffness_N_per_m) + " N/m",
      .style = look_fixed,
      .marks = true};
  for (std::size_t i = 0; i < one.T.size(); ++i) {
    add_point(curve, x_of(Over::run_time, one, i), error_of(Over::run_time, one, i));
  }
  return curve;
}

void mark_1_ms(const std::vector<Runs>& list, Over over, Panel& panel) {
  Curve curve{.name = "steps of 1 ms", .style = look_1_ms, .marks = true, .line = false, .mark_size = 1.2};
  for (const Method method : {order_1, order_2}) {
    const Runs& ours = runs_of(list, method_names[method]);
    const std::size_t i = ours.at_1_ms();
    add_point(curve, x_of(over, ours, i), error_of(over, ours, i));
  }
  panel.curves.push_back(curve);
}

// Returns how many times as fast as the best other method order 2 is; 0 if they aren't comparable.
double times_as_fast(const std::vector<Runs>& list) {
  const double times = speedup_over_tuned(runs_of(list, method_names[order_2]), list).median;
  return times > 0.0 ? times : 0.0;
}

std::string verdict_text(double times) {
  if (times == 0.0) return "not comparable";
  return times > 1.0 ? number_text(times, 2) + " × as fast" : number_text(1.0 / times, 2) + " × as long";
}

Panel panel_of(const ErrorCase& which, const std::vector<Runs>& list, const Fixed& fixed, Over over) {
  Panel panel{.title = which.title,
              .y_label = "rms error (m)",
              .log_x = true,
              .log_y = true,
              .y_low = bottom_m,
              .y_high = top_m,
              .y_ticks = {1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0},
              .y_spans = {{bottom_m, rounding_m, "rounding"}}};
  for (const Method method : {order_2, order_1}) {
    add_ours(runs_of(list, method_names[method]), method, over, panel);
  }
  if (over == Over::run_time) {
    const double times = times_as_fast(list);
    panel.title += ": " + verdict_text(times);
    panel.title_colour = times > 1.0 ? "good" : "bad";
    panel.y_spans.push_back({1e-6, 1e-3, ""});
    panel.curves.push_back(rivals_over_run_time(list));
    if (const Runs* one = fixed_runs(list, fixed); one != nullptr) panel.curves.push_back(fixed_curve(*one, fixed));
  } else {
    panel.curves.push_back(rivals_over_timestep(list));
  }
  mark_1_ms(list, over, panel);
  return panel;
}

// Sets the same range of x for all panels: whole decades, with some room at the right. Only the outer panels get
// labels.
void share_x(Chart& chart, const std::string& x_label) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const Panel& panel : chart.panels) {
    for (const Curve& curve : panel.curves) {
      for (const double x : curve.x) {
        low = std::min(low, x);
        high = std::max(high, x);
      }
    }
  }
  const auto columns = static_cast<std::size_t>(chart.columns);
  for (std::size_t i = 0; i < chart.panels.size(); ++i) {
    Panel& panel = chart.panels[i];
    panel.x_low = std::pow(10.0, std::floor(std::log10(low)));
    panel.x_high = std::pow(10.0, std::ceil(std::log10(8.0 * high)));
    for (double x = panel.x_low; x < 1.1 * panel.x_high; x *= 100.0) panel.x_ticks.push_back(x);
    if (i + columns >= chart.panels.size()) panel.x_label = x_label;
    if (i % columns != 0) panel.y_label.clear();
  }
}

std::string in_words(const ErrorCase& which) {
  std::string name = which.name;
  std::ranges::replace(name, '_', ' ');
  return name;
}

// Returns a panel that shows for all motions how many times as fast order 2 is, above or below a line at 1.
Panel verdict_panel(const RunsByCase& all) {
  Panel panel{.title = "How many times as fast order 2 is as the best of the others, for the same error",
              .y_label = "times as fast",
              .log_y = true,
              .y_low = 0.2,
              .y_high = 200.0,
              .y_ticks = {0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0},
              .levels = {{1.0, "as fast"}}};
  Curve times{.style = look_order_2, .marks = true, .line = false, .mark_size = 1.6};
  for (const ErrorCase& which : error_cases()) {
    const auto found = all.find(which.name);
    if (found == all.end()) continue;
    const double faster = times_as_fast(found->second);
    panel.x_names.push_back(in_words(which));
    if (!(faster > 0.0)) continue;
    const auto x = static_cast<double>(panel.x_names.size() - 1);
    times.x.push_back(x);
    times.y.push_back(std::clamp(faster, panel.y_low, panel.y_high));
    panel.notes.push_back({x, times.y.back(), number_text(faster, 2) + " ×", Note::Side::above, false});
  }
  panel.curves.push_back(times);
  return panel;
}

Chart case_panels(const RunsByCase& all, Over over) {
  const Fixed fixed = best_fixed(all);
  Chart chart{.columns = 2, .panel_height = 190, .key = true};
  for (const ErrorCase& which : error_cases()) {
    const auto found = all.find(which.name);
    if (found != all.end()) chart.panels.push_back(panel_of(which, found->second, fixed, over));
  }
  share_x(chart, over == Over::run_time ? "run time of the motion (µs)" : "timestep (ms)");
  return chart;
}

// A method's largest error, and its shortest and longest time of a step, over all motions with steps of 1 ms.
struct Worst {
  double error_m = 0.0, least_ns = std::numeric_limits<double>::infinity(), most_ns = 0.0;
};

Worst worst_of(const RunsByCase& all, Method method) {
  Worst worst;
  for (const auto& [name, list] : all) {
    const AtOneMs at = best_at_1_ms(list, method_names[method]);
    worst.least_ns = std::min(worst.least_ns, at.step_ns);
    worst.most_ns = std::max(worst.most_ns, at.step_ns);
    worst.error_m = std::max(worst.error_m, at.error_m);
  }
  return worst;
}

// Returns the penalty method with the smallest largest error.
Method best_penalty(const RunsByCase& all) {
  Method best = penalty_euler;
  for (const Method method : {penalty_rk4, penalty_implicit}) {
    if (worst_of(all, method).error_m < worst_of(all, best).error_m) best = method;
  }
  return best;
}

std::string micrometres(double m) { return number_text(1e6 * m, 3) + " µm"; }

std::string nanoseconds(const Worst& worst) {
  return count_text(worst.least_ns) + " to " + count_text(worst.most_ns) + " ns";
}

// Returns a penalty method's short name, for example "semi-implicit Euler".
std::string short_title(Method method) {
  const std::string title = method_titles[method];
  return title.substr(title.find(", ") + 2);
}

std::string step_answer(const RunsByCase& all) {
  const Method rival = best_penalty(all);
  return "A step of order 2 takes " + nanoseconds(worst_of(all, order_2)) + ", of " + short_title(rival) + " " +
         nanoseconds(worst_of(all, rival));
}

double place_of(std::size_t motion, std::size_t method) {
  return static_cast<double>(motion) + 0.13 * (static_cast<double>(method) - 2.5);
}

// The motions' numbers from left to right, by name.
using Places = std::map<std::string, std::size_t>;

// Two panels with all motions side by side; every other motion is shaded.
struct Glance {
  Panel error, time;
  Places places{};
};

Glance empty_glance(const RunsByCase& all) {
  Glance glance{.error = {.title = "Position error with steps of 1 ms",
                          .y_label = "rms error (m)",
                          .log_y = true,
                          .y_low = bottom_m,
                          .y_high = top_m,
                          .y_ticks = {1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0},
                          .y_spans = {{bottom_m, rounding_m, "rounding"}}},
                .time = {.title = step_answer(all),
                         .y_label = "time of a step (ns)",
                         .log_y = true,
                         .y_low = 5.0,
                         .y_high = 500.0,
                         .y_ticks = {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3}}};
  for (const ErrorCase& which : error_cases()) {
    if (!all.contains(which.name)) continue;
    const std::size_t place = glance.places.size();
    const auto x = static_cast<double>(place);
    if (place % 2 == 1) glance.error.x_spans.push_back({x - 0.5, x + 0.5, ""});
    glance.places[which.name] = place;
    glance.error.x_names.push_back(in_words(which));
  }
  glance.time.x_names = glance.error.x_names;
  glance.time.x_spans = glance.error.x_spans;
  return glance;
}

void add_method(const RunsByCase& all, std::size_t method, Glance& glance) {
  Curve error{
      .name = method_titles[method], .style = static_cast<int>(method), .marks = true, .line = false, .mark_size = 1.1};
  if (method == order_2) error.mark_size = 1.8;
  Curve time = error;
  for (const auto& [name, motion] : glance.places) {
    const AtOneMs at = best_at_1_ms(all.at(name), method_names[method]);
    if (!(at.error_m < top_m)) continue;
    error.x.push_back(place_of(motion, method));
    error.y.push_back(drawn_error(at.error_m));
    time.x.push_back(place_of(motion, method));
    time.y.push_back(at.step_ns);
    glance.time.y_low = std::min(glance.time.y_low, 0.8 * at.step_ns);
    glance.time.y_high = std::max(glance.time.y_high, 1.25 * at.step_ns);
  }
  glance.error.curves.push_back(error);
  glance.time.curves.push_back(time);
}

Chart at_a_glance(const RunsByCase& all) {
  Glance glance = empty_glance(all);
  for (std::size_t method = 0; method < method_count; ++method) {
    if (method != order_2) add_method(all, method, glance);
  }
  add_method(all, order_2, glance);  // last, so that it is drawn on top
  for (const Method method : {order_2, best_penalty(all)}) {
    const double error_m = worst_of(all, method).error_m;
    if (error_m > 0.0 && std::isfinite(error_m)) {
      glance.error.levels.push_back({drawn_error(error_m), micrometres(error_m)});
    }
  }
  return {.title = glance_answer(all),
          .subtitle = "Each method tuned to the motion. Dotted: the largest error of order 2, and of " +
                      short_title(best_penalty(all)) + ", the best penalty method",
          .panel_height = 270,
          .panels = {glance.error, glance.time},
          .key = true};
}

}  // namespace

std::string work_answer(const RunsByCase& all) {
  int faster = 0;
  for (const auto& [name, list] : all) faster += times_as_fast(list) > 1.0 ? 1 : 0;
  return "For the same error order 2 takes less time than the best of the others, tuned to the motion, in " +
         std::to_string(faster) + " of " + std::to_string(all.size()) + " motions";
}

std::string order_answer(const RunsByCase& all) {
  const auto good = [&all](Method method) {
    return std::ranges::count_if(all, [method](const auto& motion) {
      const double order = fit_order(runs_of(motion.second, method_names[method])).order;
      return order == 0.0 || order > 1.9;
    });
  };
  return "Order 2's error is rounding or falls at least by the timestep's square in " + std::to_string(good(order_2)) +
         " of " + std::to_string(all.size()) + " motions, order 1's in " + std::to_string(good(order_1));
}

std::string glance_answer(const RunsByCase& all) {
  const Method rival = best_penalty(all);
  return "At 1 ms order 2 errs by at most " + micrometres(worst_of(all, order_2).error_m) +
         ", each penalty method by " + micrometres(worst_of(all, rival).error_m) + " or more in some motion";
}

std::vector<std::string> draw_errors(const Table& table, const std::filesystem::path& out) {
  const RunsByCase all = collect(table);
  Chart work = case_panels(all, Over::run_time), order = case_panels(all, Over::timestep), glance = at_a_glance(all);
  work.title = work_answer(all);
  work.subtitle =
      "Others: penalty walls and the ROS admittance rule. Errors are those of the worst run but one of ten, compared "
      "from "
      "1 µm to 1 mm (shaded) as far as both reach. Panels' titles: order 2 beside the best of the others.";
  work.panels.insert(work.panels.begin(), verdict_panel(all));
  work.first_wide = true;
  order.title = order_answer(all);
  std::vector<std::string> warnings;
  for (const auto& [chart, file] :
       {std::pair{&work, "error.svg"}, std::pair{&order, "error_order.svg"}, std::pair{&glance, "error_at_1ms.svg"}}) {
    const std::string warning = draw(*chart, out / file);
    if (!warning.empty()) warnings.push_back(warning);
  }
  return warnings;
}

}  // namespace proxarm::studies
