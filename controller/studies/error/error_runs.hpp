// What the error study's table says: run times for an error, orders of convergence, and which penalty method is best.
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
  double timing_low = 1.0, timing_high = 1.0;  // marks of a tenth and nine tenths of the step times, by their median

  // Run time for an error that nine of ten phases keep below `target`, with that timestep and all finer ones; infinite
  // where none is that good.
  [[nodiscard]] double cost(double target) const;
  // The run with steps of 1 ms. Throws std::out_of_range where there is none.
  [[nodiscard]] std::size_t at_1_ms() const;
};

using RunsByCase = std::map<std::string, std::vector<Runs>>;

RunsByCase collect(const Table& table);

inline bool is_penalty(const Runs& runs) { return runs.method != "1" && runs.method != "2"; }

// The first runs of a method. Throws std::out_of_range where there are none.
const Runs& runs_of(const std::vector<Runs>& list, const std::string& method);

// A penalty method with one tuning for all cases.
struct Fixed {
  std::string method{};
  Tuning tuning{};
};

// The method and tuning that is best over all cases together at 0.1 mm: the one with the least geometric mean of run
// times. A case in which it doesn't reach 0.1 mm counts as a thousand times the best-tuned one's time.
Fixed best_fixed(const RunsByCase& all);

// Its runs among those of a case, which may have less to tune; nullptr where there are none.
const Runs* fixed_runs(const std::vector<Runs>& list, const Fixed& fixed);

// The best of the penalty methods at 0.1 mm.
const Runs& best_tuned(const std::vector<Runs>& list);

// The other methods' run time over ours at equal error, median over the errors that both reach: whatever is best for
// that error, or one method alone. Low and high: the same with what the step times scatter by against and for us.
Spread speedup_over_tuned(const Runs& ours, const std::vector<Runs>& rivals);
Spread speedup_over(const Runs& ours, const Runs& rival);

// Of a method on a case: the run with steps of 1 ms whose tuning errs least there. Infinite where none ends.
struct AtOneMs {
  double error_m = 0.0, step_ns = 0.0;
};
AtOneMs best_at_1_ms(const std::vector<Runs>& list, const std::string& method);

// Slope of log error over log T, where the error is above rounding, and the rms of what is left, in decades.
struct Fit {
  double order = 0.0, residual = 0.0;
};
Fit fit_order(const Runs& runs);

}  // namespace proxarm::studies
