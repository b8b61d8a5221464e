// The loop around the cycle: wakes at t_k, runs it, looks after lateness, ends after the stop.
//
// On time: t_{k+1} = t_k + T. A cycle that ends after the next t_k is an overrun; the periods that it missed
// are skipped, never caught up in a burst, and the drives see a longer step instead. So are periods that the loop slept
// through, as a suspended process does. Late and skipped cycles in a row are counted together: Fault::overrun.
// Simulated time that keeps pace with the clock waits for late cycles, up to 0.2 s (SimulatedCanNetwork): they are
// counted as overruns, but none is skipped, and they are no fault.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "controller/cycle/cycle.hpp"
#include "controller/record/page_faults.hpp"

namespace proxarm::controller {

struct SessionHooks {
  std::function<void(std::int64_t t_k_ns)> before_cycle;  // at t_k, before SYNC: a simulation's truth is read here
  std::function<void()> after_cycle;                      // in the slack: drain the records here, or in another thread
};

// Why a session came to its end.
enum class SessionEnd : std::uint8_t {
  duration,         // it rendered for as long as was wanted
  asked,            // request_stop() from outside the loop: a signal
  hold_expired,     // a hold that no fault caused lasted for hold_s, and nobody ended it
  release_expired,  // the arm followed the hand for `longest_release_s`, and nobody was left to end it
  fault,            // the supervisor's report says which
};

// How long a session lasts.
struct SessionLength {
  double duration_s;  // of rendering
  // How long a release (Phase::freeing) may last once the script has no order left. Only an order or the enabling
  // input ends a release, so a session that takes orders from nowhere else would go on for good.
  double longest_release_s = std::numeric_limits<double>::infinity();
};

struct SessionTally {
  SessionEnd end = SessionEnd::fault;
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;  // cycles that ended after the next was due, and gaps that were slept through
  std::uint64_t skipped = 0;   // periods without a cycle
  PageFaults page_faults;      // of the loop's thread, after the first cycle
};

// Runs from the first cycle until the drives are off again; after `length` it asks for the stop.
SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, const SessionLength& length,
                         const SessionHooks& hooks);

}  // namespace proxarm::controller
