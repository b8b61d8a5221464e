// Evaluates the error study's table: finds run times for a given error, orders of convergence, and the best penalty
// method.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "controller/extras/studies/common/table.hpp"
#include "controller/extras/studies/error/error_methods.hpp"

namespace proxarm::studies {

// The runs of one method with one tuning on one motion, from the coarsest timestep to the finest. Each vector has one
// element per timestep.
struct Runs {
  std::string method{};
  Tuning tuning{};
  std::vector<double> T{}, steps{};
  std::vector<Spread> error{};
  std::vector<double> cost_ns{};
  // Tenth and ninetieth percentile of the time of a step, divided by the median time.
  double timing_low = 1.0, timing_high = 1.0;

  // Returns the least run time for which nine of ten phases keep the error below `target`, at that run's timestep and
  // at all finer ones. Returns infinity if no timestep does.
  [[nodiscard]] double cost(double target) const;
  // Returns the index of the run with steps of 1 ms. Throws std::out_of_range if there is none.
  [[nodiscard]] std::size_t at_1_ms() const;
};

using RunsByCase = std::map<std::string, std::vector<Runs>>;

RunsByCase collect(const Table& table);

inline bool is_penalty(const Runs& runs) { return runs.method != "1" && runs.method != "2"; }

// Returns the first runs of a method in the list. Throws std::out_of_range if there are none.
const Runs& runs_of(const std::vector<Runs>& list, const std::string& method);

// A penalty method and its tuning, which is the same for all cases.
struct Fixed {
  std::string method{};
  Tuning tuning{};
};

// Returns the method and tuning whose run times for an error of 0.1 mm have the least geometric mean over all cases. If
// the error isn't reached in a case, the run time counts as a thousand times that of the method that is best tuned to
// the case.
Fixed best_fixed(const RunsByCase& all);

// Returns the runs of the fixed method on a case; nullptr if there are none. In a case without friction or surfaces,
// parameters that don't apply may differ.
const Runs* fixed_runs(const std::vector<Runs>& list, const Fixed& fixed);

// Returns the runs of the penalty method and tuning that are fastest for an error of 0.1 mm.
const Runs& best_tuned(const std::vector<Runs>& list);

// Return the rival's run time divided by ours for the same error, as the median over the errors that both reach. With
// `rivals`, the fastest rival for each error counts. `low` and `high` include the scatter of the step times, to our
// disadvantage and to our advantage.
Spread speedup_over_tuned(const Runs& ours, const std::vector<Runs>& rivals);
Spread speedup_over(const Runs& ours, const Runs& rival);

// A method's error and time of a step with steps of 1 ms, with the tuning that has the least error there. The error is
// infinite if it is with all tunings.
struct AtOneMs {
  double error_m = 0.0, step_ns = 0.0;
};
AtOneMs best_at_1_ms(const std::vector<Runs>& list, const std::string& method);

// The order of convergence: the slope of log error over log T where the error is above rounding. `residual` is the rms
// of the fit's residuals, in decades.
struct Fit {
  double order = 0.0, residual = 0.0;
};
Fit fit_order(const Runs& runs);

}  // namespace proxarm::studies
