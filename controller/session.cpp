#include "controller/session.hpp"

#include <cmath>

namespace proxarm::controller {

SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, double duration_s, const SessionHooks& hooks) {
  const std::int64_t wanted_ns = std::llround(duration_s * 1e9);
  SessionTally tally;
  PageFaults before;
  std::uint32_t overruns_in_a_row = 0;
  std::int64_t t_k_ns = network.now_ns() + cycle.period_ns();
  while (cycle.supervisor().phase() != Phase::done) {
    network.sleep_until(t_k_ns);
    if (hooks.before_cycle) hooks.before_cycle(t_k_ns);
    cycle.run_cycle(t_k_ns);
    ++tally.cycles;
    if (cycle.rendered_ns() >= wanted_ns) cycle.request_stop();
    if (hooks.after_cycle) hooks.after_cycle();
    if (tally.cycles == 1) before = thread_page_faults();

    const std::int64_t period_ns = cycle.period_ns();  // it may have changed in this cycle
    t_k_ns += period_ns;
    const std::int64_t late_ns = network.now_ns() - t_k_ns;
    if (late_ns > 0) {
      ++tally.overruns;
      cycle.report_overruns(++overruns_in_a_row);
      const std::int64_t missed = late_ns / period_ns;
      tally.skipped += static_cast<std::uint64_t>(missed);
      t_k_ns += missed * period_ns;
    } else {
      overruns_in_a_row = 0;
      cycle.report_overruns(0);
    }
  }
  tally.page_faults = thread_page_faults().since(before);
  return tally;
}

}  // namespace proxarm::controller
