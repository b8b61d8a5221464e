// Runs a simulated session at the pace of its options, and measures the machine's times of it: for `proxarm run` and
// for sessions in your own program.
#pragma once

#include <cstdint>
#include <functional>

#include "controller/library/simulated_loop.hpp"
#include "controller/preparation/run_options.hpp"
#include "controller/report/latency.hpp"
#include "controller/report/summary.hpp"

namespace proxarm::controller {

struct PacedRun {
  SessionTally tally;
  double wall_s = 0.0;
  LatencyHistogram wake_up;  // how late the machine woke before each cycle; meaningful at the pace of the clock
};

// Precondition: loop.start() was called. `look` sees each cycle's record; `before` is called before each cycle, at its
// time. Throws SetupError if the simulation has become unstable.
PacedRun run_at_pace(SimulatedLoop& loop, const PreparedSession& session, const RunOptions& options,
                     const LookAtCycle& look, const std::function<void(std::int64_t t_k_ns)>& before);

// Adds the figures of the run's time and of the buses to a session's summary.
void add_figures(Summary& summary, const PacedRun& run, const SimulatedLoop& loop, const RunOptions& options);

}  // namespace proxarm::controller
