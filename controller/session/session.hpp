// The loop around the cycle: wakes up at t_k, runs the cycle, handles lateness, and ends after the stop.
//
// t_{k+1} = t_k + T. A cycle that ends after the next t_k is an overrun. The periods missed by an overrun are skipped,
// never caught up in a burst, and the drives see a longer step. Periods in which the process was suspended are skipped,
// too. Late and skipped cycles in a row raise Fault::overrun. Simulated time that keeps pace with the clock waits up to
// 0.2 s for a late cycle (SimulatedCanNetwork): the late cycle counts as an overrun, but nothing is skipped and no
// fault is raised.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "controller/cycle/cycle.hpp"
#include "controller/record/page_faults.hpp"

namespace proxarm::controller {

struct SessionHooks {
  std::function<void(std::int64_t t_k_ns)> before_cycle;  // at t_k, before SYNC; may read the simulation's state
  // Called after the cycle: for draining the records, unless another thread drains them.
  std::function<void()> after_cycle;
};

enum class SessionEnd : std::uint8_t {
  duration,         // the wanted rendering time is over
  asked,            // request_stop() was called outside the loop, for example on a signal
  hold_expired,     // a hold without a fault lasted for hold_s
  release_expired,  // the arm followed the hand for `longest_release_s` without an order
  fault,            // the supervisor's report says which
};

struct SessionLength {
  double duration_s;  // time to be rendered
  // The longest release (Phase::freeing), s, once the script has no order left. Only an order or the enabling input
  // ends a release, so without another source of orders the session would never end.
  double longest_release_s = std::numeric_limits<double>::infinity();
};

struct SessionTally {
  SessionEnd end = SessionEnd::fault;
  std::uint64_t cycles = 0;
  // Number of cycles that ended after the next cycle was due, plus number of intervals without cycles (process
  // suspended).
  std::uint64_t overruns = 0;
  std::uint64_t skipped = 0;  // periods without a cycle
  PageFaults page_faults;     // page faults of the loop's thread, from the second cycle on
};

// Runs from the first cycle until the drives are off again. Requests the stop after `length`.
SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, const SessionLength& length,
                         const SessionHooks& hooks);

}  // namespace proxarm::controller
