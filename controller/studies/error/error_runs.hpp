// Evaluates the error study's table: run times for an error, orders of convergence, and the best penalty method.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "controller/studies/common/table.hpp"
#include "controller/studies/error/error_methods.hpp"

namespace proxarm::studies {

// The runs of one method with one tuning, from coarse to fine.
struct Runs {
  std::string method{};
  Tuning tuning{};
  std::vector<double> T{}, steps{};
  std::vector<Spread> error{};
  std::vector<double> cost_ns{};
  double timing_low = 1.0,
         timing_high = 1.0;  // tenth and ninetieth percentile of the step times, divided by their median

  // Run time for an error that nine of ten phases keep below `target`, at that timestep and all finer ones; infinite if
  // no timestep reaches it.
  [[nodiscard]] double cost(double target) const;
  // The run with steps of 1 ms. Throws std::out_of_range if there is none.
  [[nodiscard]] std::size_t at_1_ms() const;
};

using RunsByCase = std::map<std::string, std::vector<Runs>>;

RunsByCase collect(const Table& table);

inline bool is_penalty(const Runs& runs) { return runs.method != "1" && runs.method != "2"; }

// The first runs of a method. Throws std::out_of_range if there are none.
const Runs& runs_of(const std::vector<Runs>& list, const std::string& method);

// A penalty method with one tuning for all cases.
struct Fixed {
  std::string method{};
  Tuning tuning{};
};

// The method and tuning with the least geometric mean of run times for 0.1 mm over all cases. If it doesn't reach 0.1
// mm in a case, that case counts as a thousand times the time of its best-tuned method.
Fixed best_fixed(const RunsByCase& all);

// The fixed method's runs for a case, which may have fewer parameters to tune; nullptr if there are none.
const Runs* fixed_runs(const std::vector<Runs>& list, const Fixed& fixed);

// The best penalty method for 0.1 mm.
const Runs& best_tuned(const std::vector<Runs>& list);

// The other methods' run time divided by ours at equal error; median over the errors that both reach. `rivals`: the
// best of them for each error. Low and high include the scatter of the step times against us and for us.
Spread speedup_over_tuned(const Runs& ours, const std::vector<Runs>& rivals);
Spread speedup_over(const Runs& ours, const Runs& rival);

// A method's run with steps of 1 ms, with the tuning that errs least there. The error is infinite if no run ends.
struct AtOneMs {
  double error_m = 0.0, step_ns = 0.0;
};
AtOneMs best_at_1_ms(const std::vector<Runs>& list, const std::string& method);

// Slope of log error over log T where the error is above rounding; and the rms of the residuals, in decades.
struct Fit {
  double order = 0.0, residual = 0.0;
};
Fit fit_order(const Runs& runs);

}  // namespace proxarm::studies
