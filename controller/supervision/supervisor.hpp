// The phase of a session and the events that change it: one table, transitions(), shown in docs/supervision.md.
//
//   idle ─▶ enabling ─▶ taring ─▶ rendering ─▶ stopping ─▶ disabling ─▶ done
//                                 ▲       │                    │
//                          resume │       ▼ hold               ▼
//                                  holding ◀─ enabling ◀── faulted
//                           freed, ▲     │            reset
//                            hold  │     ▼ free
//                                  freeing
//
// A fault acts by its reaction (fault.hpp). A stop latches and reports the first fault; only a reset leaves this state,
// into a hold. If a drive moves uncontrolled while the arm stops, or before its drives are off, the stop becomes one of
// category 0: the first fault remains the reported one, the second is the escalation. Faults with the reactions
// `continue`, `slow` and `hold` are counted.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "controller/supervision/fault.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

enum class Phase : std::uint8_t {
  idle,       // drives configured, only SYNC and heartbeat sent; waits for the enabling input
  enabling,   // drives go through CiA 402 to operation enabled; targets follow the actual positions
  taring,     // targets stand still; the sensor's bias is averaged
  rendering,  // the proxy moves, the arm follows
  holding,    // all joints brake together along their last motion, then stand; drives stay enabled
  freeing,    // from a hold: the arm follows the hand or backs off, slowly and without the scene
  stopping,   // all joints brake together along their last motion, in the time of the slowest
  disabling,  // targets stand still; the drives are switched off
  faulted,    // drives off; waits for a reset
  done,
};
inline constexpr std::size_t phase_count = static_cast<std::size_t>(Phase::done) + 1;

enum class Event : std::uint8_t {
  begin,      // first cycle; with an enabling input: it was released and pressed
  enabled,    // all drives follow
  reenabled,  // the same after a reset: no tare is needed, and a person may be pinned
  tared,      //
  hold,       // a fault with this reaction, or a command
  resume,     // the cause has ended and the enabling input is pressed, or a command
  free,       // a command: release, or back off
  freed,      // the order hold, or the end of backing off
  stop,       // requested: end of the duration, signal
  fault,      // stop category 1
  fault_off,  // stop category 0
  at_rest,    //
  disabled,   // all drives are off, or the time to confirm it is over
  wait,       // the same after a fault that may be reset
  reset,      // a command
};
inline constexpr std::size_t event_count = static_cast<std::size_t>(Event::reset) + 1;

const char* phase_name(Phase phase) noexcept;
const char* event_name(Event event) noexcept;

struct Transition {
  Phase from;
  Event event;
  Phase to;
};
[[nodiscard]] std::span<const Transition> transitions() noexcept;

// Occurrences of a fault that didn't stop the arm.
struct Notice {
  std::uint32_t times = 0;   // occurrences, each after a cycle without the fault
  std::uint64_t cycles = 0;  // cycles with the fault
  std::uint64_t last = 0;    // the last of these cycles plus one; 0: none
};

class Supervisor {
 public:
  Supervisor() : Supervisor(reactions_of({})) {}
  explicit Supervisor(const Reactions& reactions) noexcept : reactions_(reactions) {}

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  // Whether the drives may move in this phase, so that the enabling input must be pressed.
  [[nodiscard]] bool live() const noexcept {
    return phase_ == Phase::rendering || phase_ == Phase::holding || phase_ == Phase::freeing;
  }
  [[nodiscard]] bool faulted() const noexcept { return report_.fault != Fault::none; }
  [[nodiscard]] const FaultReport& report() const noexcept { return report_; }  // the fault that stopped the arm
  // The fault that turned the stop in progress into category 0, or none.
  [[nodiscard]] const FaultReport& escalation() const noexcept { return escalation_; }
  // Whether the drives lose power at once (stop category 0).
  [[nodiscard]] bool cuts_power() const noexcept {
    return escalation_.fault != Fault::none || (faulted() && report_.reaction == Reaction::stop_0);
  }
  [[nodiscard]] const FaultReport& held_for() const noexcept { return held_for_; }  // none: the hold was requested
  [[nodiscard]] Reaction reaction(Fault fault) const noexcept { return reactions_[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] const Notice& notice(Fault fault) const noexcept { return notices_[static_cast<std::size_t>(fault)]; }
  // Whether a fault that slows the arm occurred in one of the last `cycles`.
  [[nodiscard]] bool slowed(std::uint64_t cycle, std::uint64_t cycles) const noexcept {
    return slow_end_ > 0 && cycle < slow_end_ + cycles;
  }
  // Whether the cause of the hold lasts, or occurred in one of the last `cycles`.
  [[nodiscard]] bool cause_lasts(std::uint64_t cycle, std::uint64_t cycles) const noexcept {
    return held_for_.fault != Fault::none && cycle < notice(held_for_.fault).last + cycles;
  }

  // Changes the phase if transitions() has a row for this event; otherwise ignores the event. Returns whether there was
  // one.
  bool handle(Event event) noexcept;
  // Applies the fault's reaction.
  void raise(FaultReport report) noexcept;
  // A hold lasted too long: the arm stops because of the hold's fault.
  void give_up_hold() noexcept;
  // Begins a hold on request: held_for() is none.
  void hold() noexcept;
  // Leaves the phase `faulted` and clears the fault, so read report() before. Returns false in any other phase.
  bool reset() noexcept;

  // Changes to a timestep with `ratio` times as many cycles per time. Converts past cycle numbers so that their
  // distances in time from this cycle stay.
  void rescale(std::uint64_t cycle, double ratio) noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(phase_, slow_end_);
    for (FaultReport* report : {&report_, &escalation_, &held_for_}) {
      state(report->fault, report->where, report->cycle, report->value, report->limit, report->reaction,
            report->force_W_N);
    }
    for (Notice& notice : notices_) state(notice.times, notice.cycles, notice.last);
  }

 private:
  void note(const FaultReport& report) noexcept;
  [[nodiscard]] bool escalates(Fault fault) const noexcept;
  [[nodiscard]] Reaction reaction_now(Fault fault) const noexcept;

  Reactions reactions_;
  Phase phase_ = Phase::idle;
  FaultReport report_, escalation_, held_for_;
  std::uint64_t slow_end_ = 0;  // last cycle with a slowing fault, plus one; 0: none
  std::array<Notice, fault_count> notices_{};
};

}  // namespace proxarm::controller
