#include "controller/studies/error/error_runs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace proxarm::studies {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Errors that matter to an arm: from a micrometre, which its encoders resolve, to a millimetre.
std::vector<double> targets() {
  std::vector<double> list;
  for (int i = 0; i <= 30; ++i) list.push_back(std::pow(10.0, -6.0 + 0.1 * i));
  return list;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

template <typename Cost>
double speedup(const Runs& ours, Cost rival_cost) {
  std::vector<double> ratios;
  for (const double target : targets()) {
    const double rival = rival_cost(target), own = ours.cost(target);
    if (std::isfinite(rival) && std::isfinite(own)) ratios.push_back(rival / own);
  }
  return median(ratios);
}

double tuned_cost(const std::vector<Runs>& list, double target) {
  double least = infinity;
  for (const Runs& runs : list) {
    if (is_penalty(runs)) least = std::min(least, runs.cost(target));
  }
  return least;
}

bool matches(const Fixed& fixed, const Runs& runs) {
  if (runs.method != fixed.method) return false;
  // Cases without friction or surfaces have less to tune.
  const bool k = runs.tuning.stiffness_N_per_m == fixed.tuning.stiffness_N_per_m,
             c = runs.tuning.damping_ratio == fixed.tuning.damping_ratio;
  return k && c && (runs.tuning.friction_slope == fixed.tuning.friction_slope || runs.tuning.friction_slope == 1.0);
}

}  // namespace

double Runs::envelope(std::size_t i) const {
  double most = error[i];
  for (std::size_t j = i; j < T.size() && T[j] > 0.499 * T[i]; ++j) most = std::max(most, error[j]);
  return most;
}

double Runs::cost(double target) const {
  double least = infinity;
  for (std::size_t i = 0; i < T.size(); ++i) {
    if (envelope(i) <= target) least = std::min(least, cost_ns[i]);
  }
  return least;
}

RunsByCase collect(const Table& table) {
  RunsByCase all;
  const std::size_t name = table.column("case"), method = table.column("method"), k = table.column("stiffness_N_per_m"),
                    ratio = table.column("damping_ratio"), slope = table.column("friction_slope"),
                    T = table.column("period_s"), steps = table.column("steps"),
                    error = table.column("position_error_m"), cost = table.column("run_time_ns");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    std::vector<Runs>& list = all[table.text(row, name)];
    const Tuning tuning{table.number(row, k), table.number(row, ratio), table.number(row, slope)};
    const bool same = !list.empty() && list.back().method == table.text(row, method) && list.back().tuning == tuning;
    if (!same) list.push_back({table.text(row, method), tuning, {}, {}, {}, {}});
    list.back().T.push_back(table.number(row, T));
    list.back().steps.push_back(table.number(row, steps));
    list.back().error.push_back(table.number(row, error));
    list.back().cost_ns.push_back(table.number(row, cost));
  }
  return all;
}

const Runs& runs_of(const std::vector<Runs>& list, const std::string& method) {
  for (const Runs& runs : list) {
    if (runs.method == method) return runs;
  }
  throw std::out_of_range("no runs of " + method);
}

const Runs* fixed_runs(const std::vector<Runs>& list, const Fixed& fixed) {
  const Runs *exact = nullptr, *any = nullptr;
  for (const Runs& runs : list) {
    if (runs.method != fixed.method) continue;
    any = &runs;
    if (matches(fixed, runs) && (exact == nullptr || runs.tuning.friction_slope == fixed.tuning.friction_slope)) {
      exact = &runs;
    }
  }
  return exact != nullptr ? exact : any;
}

Fixed best_fixed(const RunsByCase& all) {
  Fixed best;
  double least = infinity;
  const auto slide = all.find("slide") != all.end() ? all.find("slide") : all.begin();
  for (const Runs& candidate : slide->second) {
    if (!is_penalty(candidate)) continue;
    const Fixed fixed{candidate.method, candidate.tuning};
    double sum = 0.0;
    for (const auto& [name, list] : all) {
      const Runs* runs = fixed_runs(list, fixed);
      const double cost = runs == nullptr ? infinity : runs->cost(1e-4);
      sum += std::log(std::min(cost, 1e3 * std::min(tuned_cost(list, 1e-4), 1e9)));
    }
    if (sum < least) {
      least = sum;
      best = fixed;
    }
  }
  return best;
}

const Runs& best_tuned(const std::vector<Runs>& list) {
  const Runs* best = nullptr;
  for (const Runs& runs : list) {
    if (is_penalty(runs) && (best == nullptr || runs.cost(1e-4) < best->cost(1e-4))) best = &runs;
  }
  if (best == nullptr) throw std::out_of_range("no runs of a penalty method");
  return *best;
}

double speedup_over_tuned(const Runs& ours, const std::vector<Runs>& rivals) {
  return speedup(ours, [&rivals](double target) { return tuned_cost(rivals, target); });
}

double speedup_over(const Runs& ours, const Runs& rival) {
  return speedup(ours, [&rival](double target) { return rival.cost(target); });
}

Fit fit_order(const Runs& runs) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < runs.T.size(); ++i) {
    const double e = runs.envelope(i);
    if (runs.steps[i] < 4 * instants || !(e > 1e-11) || !std::isfinite(e)) continue;
    x.push_back(std::log10(runs.T[i]));
    y.push_back(std::log10(e));
  }
  if (x.size() < 3) return {0.0, 0.0};
  double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0, rr = 0.0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
  }
  const double slope = xy / xx;
  if (slope < 0.0) return {0.0, 0.0};  // an error that grows with the number of steps is rounding
  for (std::size_t i = 0; i < x.size(); ++i) rr += std::pow(y[i] - my - slope * (x[i] - mx), 2);
  return {slope, std::sqrt(rr / n)};
}

}  // namespace proxarm::studies
