// The loop around the cycle: wakes at t_k, runs the cycle, handles lateness, ends after the stop.
//
// t_{k+1} = t_k + T. A cycle that ends after the next t_k is an overrun: the missed periods are skipped, never caught
// up in a burst, and the drives see a longer step. Periods that a suspended process sleeps through are skipped, too.
// Late and skipped cycles in a row raise Fault::overrun. Simulated time at the pace of the clock waits up to 0.2 s for
// a late cycle (SimulatedCanNetwork): this counts as an overrun, but nothing is skipped and no fault is raised.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "controller/cycle/cycle.hpp"
#include "controller/record/page_faults.hpp"

namespace proxarm::controller {

struct SessionHooks {
  std::function<void(std::int64_t t_k_ns)> before_cycle;  // at t_k, before SYNC: here a simulation's true state is read
  std::function<void()> after_cycle;                      // after the cycle: drain the records here, or in another
                                                          // thread
};

enum class SessionEnd : std::uint8_t {
  duration,         // the wanted rendering time is over
  asked,            // request_stop() from outside the loop: a signal
  hold_expired,     // a hold without a fault lasted for hold_s
  release_expired,  // the arm followed the hand for `longest_release_s` without an order
  fault,            // the supervisor's report says which
};

struct SessionLength {
  double duration_s;  // of rendering
  // The longest release (Phase::freeing) once the script has no order left, s. Only an order or the enabling input ends
  // a release, so without another source of orders the session would never end.
  double longest_release_s = std::numeric_limits<double>::infinity();
};

struct SessionTally {
  SessionEnd end = SessionEnd::fault;
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;  // cycles that ended after the next was due, and times without cycles (process suspended)
  std::uint64_t skipped = 0;   // periods without a cycle
  PageFaults page_faults;      // of the loop's thread, from the second cycle on
};

// Runs from the first cycle until the drives are off again; requests the stop after `length`.
SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, const SessionLength& length,
                         const SessionHooks& hooks);

}  // namespace proxarm::controller
