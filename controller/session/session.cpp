#include "controller/session/session.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

namespace {

// Requests the stop when the session has lasted long enough, and stores the reason for the end.
class Ending {
 public:
  explicit Ending(const SessionLength& length)
      : wanted_ns_(std::llround(length.duration_s * 1e9)), longest_release_s_(length.longest_release_s) {}

  // Called after the cycle at t_k.
  void judge(Cycle& cycle, std::int64_t t_k_ns) {
    const auto script = cycle.scheduled_commands();
    const bool awaits_order = !script.empty() && !script.back().taken;
    if (cycle.supervisor().phase() != Phase::freeing || awaits_order) released_since_ns_ = t_k_ns;
    if (cycle.stop_requested()) return;
    const double released_s = 1e-9 * static_cast<double>(t_k_ns - released_since_ns_);
    if (cycle.rendered_ns() >= wanted_ns_) {
      stop(cycle, SessionEnd::duration);
    } else if (released_s >= longest_release_s_) {
      stop(cycle, SessionEnd::release_expired);
    }
  }

  // Called after the last cycle. If the session stopped without a fault and without a request, a hold lasted too long.
  [[nodiscard]] SessionEnd reason(const Cycle& cycle) const {
    if (cycle.supervisor().faulted()) return SessionEnd::fault;
    return cycle.stop_requested() ? stopped_for_ : SessionEnd::hold_expired;
  }

 private:
  void stop(Cycle& cycle, SessionEnd reason) {
    cycle.request_stop();
    stopped_for_ = reason;
  }

  std::int64_t wanted_ns_;
  double longest_release_s_;
  std::int64_t released_since_ns_ = 0;
  SessionEnd stopped_for_ = SessionEnd::asked;  // unless stop() set another reason
};

}  // namespace

SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, const SessionLength& length,
                         const SessionHooks& hooks) {
  Ending ending(length);
  SessionTally tally;
  PageFaults before;
  std::uint32_t overruns_in_a_row = 0;
  std::int64_t t_k_ns = network.now_ns() + cycle.period_ns();
  const auto periods_since = [&](std::int64_t time_ns) { return (network.now_ns() - time_ns) / cycle.period_ns(); };
  // Skips whole periods. A skipped cycle counts as late.
  const auto skip = [&](std::int64_t periods) {
    tally.skipped += static_cast<std::uint64_t>(periods);
    t_k_ns += periods * cycle.period_ns();
    overruns_in_a_row += static_cast<std::uint32_t>(std::min<std::int64_t>(periods, 1'000'000));
    cycle.report_overruns(overruns_in_a_row);
  };
  while (cycle.supervisor().phase() != Phase::done) {
    network.sleep_until(t_k_ns);
    // Whole periods passed without a cycle: the process was suspended, or didn't get the processor.
    if (const std::int64_t missed = periods_since(t_k_ns); missed > 0) {
      ++tally.overruns;
      skip(missed);
    }
    if (hooks.before_cycle) hooks.before_cycle(t_k_ns);
    cycle.run_cycle(t_k_ns);
    ++tally.cycles;
    ending.judge(cycle, t_k_ns);
    if (hooks.after_cycle) hooks.after_cycle();
    if (tally.cycles == 1) before = thread_page_faults();

    t_k_ns += cycle.period_ns();  // the period may have changed in this cycle
    if (network.now_ns() > t_k_ns) {
      ++tally.overruns;
      ++overruns_in_a_row;
      skip(periods_since(t_k_ns));
    } else {
      // A simulation that keeps pace with the clock waits for a late host. On a real bus, the next cycle would be due
      // already.
      const bool waited_for = network.now_ns() + network.behind_ns() > t_k_ns;
      if (waited_for) ++tally.overruns;
      overruns_in_a_row = 0;
      cycle.report_overruns(0, waited_for);
    }
  }
  tally.end = ending.reason(cycle);
  tally.page_faults = thread_page_faults().since(before);
  return tally;
}

}  // namespace proxarm::controller
