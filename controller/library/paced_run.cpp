#include "controller/library/paced_run.hpp"

#include <chrono>

#include "controller/library/session_summary.hpp"

namespace proxarm::controller {
namespace {

using SteadyClock = std::chrono::steady_clock;

bool is_realtime(const RunOptions& options) { return options.pace == Pace::realtime; }

}  // namespace

PacedRun run_at_pace(SimulatedLoop& loop, const PreparedSession& session, const RunOptions& options,
                     const LookAtCycle& look, const std::function<void(std::int64_t t_k_ns)>& before) {
  PacedRun run;
  const SteadyClock::time_point begun = SteadyClock::now();
  if (is_realtime(options)) loop.network().follow_real_time();  // from now on: earlier time belongs to no cycle
  run.tally = loop.run(look, session_length(session, options), [&](std::int64_t t_k_ns) {
    before(t_k_ns);
    run.wake_up.add(loop.network().woken_late_ns());
    if (loop.exploded_after_s()) loop.cycle().request_stop();
  });
  run.wall_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  if (loop.exploded_after_s()) refuse_explosion(*loop.exploded_after_s());
  return run;
}

void add_figures(Summary& summary, const PacedRun& run, const SimulatedLoop& loop, const RunOptions& options) {
  summary.wall_time_s = run.wall_s;
  summary.overruns = run.tally.overruns;
  summary.virtual_time = !is_realtime(options);
  if (!summary.virtual_time) summary.latency_us["wake_up"] = latency_summary(run.wake_up);
  if (loop.first_cycle_ns()) summary.first_cycle_s = 1e-9 * static_cast<double>(*loop.first_cycle_ns());
  summary.bus_load = loop.bus_load();
}

}  // namespace proxarm::controller
