// The loop around the cycle: wakes at t_k, runs it, looks after lateness, ends after the stop.
//
// On time: t_{k+1} = t_k + T. A cycle that ends after the next t_k has begun is an overrun; the periods that it missed
// are skipped, never caught up in a burst, and the drives see a longer step instead.
#pragma once

#include <cstdint>
#include <functional>

#include "controller/cycle.hpp"
#include "controller/page_faults.hpp"

namespace proxarm::controller {

struct SessionHooks {
  std::function<void(std::int64_t t_k_ns)> before_cycle;  // at t_k, before SYNC: a simulation's truth is read here
  std::function<void()> after_cycle;                      // in the slack: drain the records here, or in another thread
};

struct SessionTally {
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;  // cycles that ended late
  std::uint64_t skipped = 0;   // periods without a cycle
  PageFaults page_faults;      // of the loop's thread, after the first cycle
};

// Runs from the first cycle until the drives are off again; after `duration_s` of rendering it asks for the stop.
SessionTally run_session(Cycle& cycle, fieldbus::CanNetwork& network, double duration_s, const SessionHooks& hooks);

}  // namespace proxarm::controller
