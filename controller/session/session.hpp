// The loop around the cycle: wakes at t_k, runs the cycle, handles lateness, ends after the stop.
//
// On time: t_{k+1} = t_k + T. A cycle that ends after the next t_k is an overrun. The periods that it missed are
// skipped, never caught up in a burst; the drives see a longer step instead. Periods that the process slept through
// (suspended) are skipped, too. Late and skipped cycles in a row are counted together: Fault::overrun. Simulated time
// at the pace of the clock waits up to 0.2 s for late cycles (SimulatedCanNetwork): they count as overruns, but none is
// skipped and no fault is raised.
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

// Why a session ended.
enum class SessionEnd : std::uint8_t {
  duration,         // the wanted rendering time is over
  asked,            // request_stop() from outside the loop: a signal
  hold_expired,     // a hold without a fault lasted for hold_s
  release_expired,  // the arm followed the hand for `longest_release_s` without an order
  fault,            // the supervisor's report says which
};

// How long a session lasts.
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
