#include "controller/extras/studies/error/error_runs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace proxarm::studies {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns the errors that matter to an arm: from a micrometre, which an arm's encoders resolve, to a millimetre.
std::vector<double> targets() {
  std::vector<double> list;
  for (int i = 0; i <= 30; ++i) list.push_back(std::pow(10.0, -6.0 + 0.1 * i));
  return list;
}

// Returns the runs with the least run time for the error `target`; nullptr if no runs reach that error.
const Runs* cheapest(const std::vector<const Runs*>& list, double target) {
  const Runs* best = nullptr;
  for (const Runs* runs : list) {
    if (std::isfinite(runs->cost(target)) && (best == nullptr || runs->cost(target) < best->cost(target))) best = runs;
  }
  return best;
}

Spread speedup(const Runs& ours, const std::vector<const Runs*>& rivals) {
  std::vector<double> low, middle, high;
  for (const double target : targets()) {
    const Runs* rival = cheapest(rivals, target);
    const double own = ours.cost(target);
    if (rival == nullptr || !std::isfinite(own)) continue;
    const double ratio = rival->cost(target) / own;
    middle.push_back(ratio);
    low.push_back(ratio * rival->timing_low / ours.timing_high);
    high.push_back(ratio * rival->timing_high / ours.timing_low);
  }
  if (middle.empty()) return {};
  return {Spread::of(low).median, Spread::of(middle).median, Spread::of(high).median};
}

std::vector<const Runs*> penalties(const std::vector<Runs>& list) {
  std::vector<const Runs*> found;
  for (const Runs& runs : list) {
    if (is_penalty(runs)) found.push_back(&runs);
  }
  return found;
}

double tuned_cost(const std::vector<Runs>& list, double target) {
  const Runs* best = cheapest(penalties(list), target);
  return best == nullptr ? infinity : best->cost(target);
}

bool matches(const Fixed& fixed, const Runs& runs) {
  if (runs.method != fixed.method) return false;
  if (runs.tuning.staggered != fixed.tuning.staggered) return false;
  // In cases without friction or surfaces the tuning has fewer parameters.
  const bool k = runs.tuning.stiffness_N_per_m == fixed.tuning.stiffness_N_per_m,
             c = runs.tuning.damping_ratio == fixed.tuning.damping_ratio;
  return k && c && (runs.tuning.friction_slope == fixed.tuning.friction_slope || runs.tuning.friction_slope == 1.0);
}

}  // namespace

double Runs::cost(double target) const {
  double least = infinity;
  for (std::size_t i = T.size(); i-- > 0 && error[i].high <= target;) least = std::min(least, cost_ns[i]);
  return least;
}

std::size_t Runs::at_1_ms() const {
  for (std::size_t i = 0; i < T.size(); ++i) {
    if (std::abs(T[i] - 1e-3) < 1e-9) return i;
  }
  throw std::out_of_range("no run with steps of 1 ms of " + method);
}

// The time of a method's step is computed as its measured ratio to the time of a step of (26), multiplied by the least
// measured time of a step of (26).
RunsByCase collect(const Table& table) {
  RunsByCase all;
  std::map<std::string, double> reference_ns;
  const auto column = [&table](const char* key) { return table.column(key); };
  const std::size_t name = column("case"), method = column("method"), k = column("stiffness_N_per_m"),
                    ratio = column("damping_ratio"), slope = column("friction_slope"), staggered = column("staggered"),
                    T = column("period_s"), steps = column("steps"), ns = column("reference_step_ns"),
                    share = column("of_reference"), share_low = column("of_reference_low"),
                    share_high = column("of_reference_high"), error = column("position_error_m"),
                    error_low = column("position_error_low_m"), error_high = column("position_error_high_m");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    double& least = reference_ns.emplace(table.text(row, name), infinity).first->second;
    least = std::min(least, table.number(row, ns));
  }
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto number = [&table, row](std::size_t at) { return table.number(row, at); };
    std::vector<Runs>& list = all[table.text(row, name)];
    const Tuning tuning{number(k), number(ratio), number(slope), number(staggered) != 0.0};
    const std::string& its_method = table.text(row, method);
    if (list.empty() || list.back().method != its_method || !(list.back().tuning == tuning)) {
      list.push_back({.method = its_method, .tuning = tuning});
    }
    Runs& runs = list.back();
    runs.timing_low = number(share_low) / number(share);
    runs.timing_high = number(share_high) / number(share);
    runs.T.push_back(number(T));
    runs.steps.push_back(number(steps));
    runs.error.push_back({number(error_low), number(error), number(error_high)});
    runs.cost_ns.push_back(number(steps) * number(share) * reference_ns[table.text(row, name)]);
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

Spread speedup_over_tuned(const Runs& ours, const std::vector<Runs>& rivals) {
  return speedup(ours, penalties(rivals));
}

Spread speedup_over(const Runs& ours, const Runs& rival) { return speedup(ours, {&rival}); }

AtOneMs best_at_1_ms(const std::vector<Runs>& list, const std::string& method) {
  AtOneMs best{infinity, 0.0};
  for (const Runs& runs : list) {
    if (runs.method != method) continue;
    const std::size_t i = runs.at_1_ms();
    if (runs.error[i].median < best.error_m) best = {runs.error[i].median, runs.cost_ns[i] / runs.steps[i]};
  }
  return best;
}

Fit fit_order(const Runs& runs) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < runs.T.size(); ++i) {
    const double e = runs.error[i].median;
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
  if (slope < 0.0) return {0.0, 0.0};  // an error that grows with finer steps is rounding
  for (std::size_t i = 0; i < x.size(); ++i) rr += std::pow(y[i] - my - slope * (x[i] - mx), 2);
  return {slope, std::sqrt(rr / n)};
}

}  // namespace proxarm::studies
