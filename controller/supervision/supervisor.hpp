// Keeps the phase of a session. Events change the phase by the table transitions() (shown in
// docs/reference/supervision.md).
//
//   idle ─▶ enabling ─▶ taring ─▶ rendering ─▶ stopping ─▶ disabling ─▶ done
//                                 ▲       │                    │
//                          resume │       ▼ hold               ▼
//                                  holding ◀─ enabling ◀── faulted
//                           freed, ▲     │            reset
//                            hold  │     ▼ free
//                                  freeing
//
// A fault acts by its reaction (fault.hpp). A stop latches and reports the first fault; only a reset clears this fault,
// and begins a hold. If a drive moves uncontrolled while the arm stops, or before its drives are off, a second fault
// turns the stop into stop category 0: report() remains the first fault, and escalation() is the second fault. Faults
// with the reactions `continue`, `slow` and `hold` are counted.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "controller/supervision/fault.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

enum class Phase : std::uint8_t {
  idle,       // drives are configured; only SYNC and heartbeat are sent; waits for the enabling input
  enabling,   // drives go through CiA 402 to operation enabled; targets follow the actual positions
  taring,     // targets stand still; the sensor's bias is averaged
  rendering,  // the proxy moves, and the arm follows it
  holding,    // all joints brake together along their last motion, then stand; drives stay enabled
  freeing,    // after a hold: the arm follows the hand or backs off, slowly and without the scene
  stopping,   // all joints brake together along their last motion, in the time that the slowest joint needs
  disabling,  // targets stand still; the drives are switched off
  faulted,    // the drives are off; waits for a reset
  done,
};
inline constexpr std::size_t phase_count = static_cast<std::size_t>(Phase::done) + 1;

enum class Event : std::uint8_t {
  begin,      // the first cycle; with an enabling input: the input was released and then pressed
  enabled,    // all drives take setpoints
  reenabled,  // all drives take setpoints again after a reset: no tare is needed, and a person may be pinned
  tared,      // the tare is complete
  hold,       // a fault with the reaction `hold`, or a command
  resume,     // the hold's cause has ended, and the enabling input was pressed anew or a command was given
  free,       // the command release or back off
  freed,      // the order hold, or the end of backing off
  stop,       // the session's end was requested: end of its duration, or a signal
  fault,      // a fault with stop category 1
  fault_off,  // a fault with stop category 0
  at_rest,    // the arm has stopped
  disabled,   // all drives are off, or their time to confirm this is over
  wait,       // all drives are off after a fault that may be reset
  reset,      // the command reset
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
  std::uint32_t times = 0;   // number of occurrences, each after a cycle without the fault
  std::uint64_t cycles = 0;  // number of cycles with the fault
  std::uint64_t last = 0;    // number of the last cycle with the fault, plus one; 0: no such cycle
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
  // The fault that turned the stop in progress into stop category 0; Fault::none: no fault did.
  [[nodiscard]] const FaultReport& escalation() const noexcept { return escalation_; }
  // Whether the drives lose power at once (stop category 0).
  [[nodiscard]] bool cuts_power() const noexcept {
    return escalation_.fault != Fault::none || (faulted() && report_.reaction == Reaction::stop_0);
  }
  // The fault that caused the hold; Fault::none: the hold was requested.
  [[nodiscard]] const FaultReport& held_for() const noexcept { return held_for_; }
  [[nodiscard]] Reaction reaction(Fault fault) const noexcept { return reactions_[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] const Notice& notice(Fault fault) const noexcept { return notices_[static_cast<std::size_t>(fault)]; }
  // Whether a fault that slows the arm occurred in one of the last `cycles` cycles.
  [[nodiscard]] bool slowed(std::uint64_t cycle, std::uint64_t cycles) const noexcept {
    return slow_end_ > 0 && cycle < slow_end_ + cycles;
  }
  // Whether the fault that caused the hold occurred in one of the last `cycles` cycles.
  [[nodiscard]] bool cause_lasts(std::uint64_t cycle, std::uint64_t cycles) const noexcept {
    return held_for_.fault != Fault::none && cycle < notice(held_for_.fault).last + cycles;
  }

  // Changes the phase if transitions() has a row for this phase and event, and returns true. Otherwise ignores the
  // event and returns false.
  bool handle(Event event) noexcept;
  // Applies the fault's reaction.
  void raise(FaultReport report) noexcept;
  // Stops the arm after a hold that has lasted too long. The fault that caused the hold becomes report().
  void give_up_hold() noexcept;
  // Begins a hold on request, so held_for() is Fault::none.
  void hold() noexcept;
  // Leaves the phase `faulted` and clears the fault, so read report() before this call. Returns false in any other
  // phase.
  bool reset() noexcept;

  // Call when the timestep changes. `ratio`: old timestep divided by new timestep. Converts the numbers of past cycles
  // so that their distances in time from this cycle don't change.
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
  std::uint64_t slow_end_ = 0;  // number of the last cycle with a slowing fault, plus one; 0: no such cycle
  std::array<Notice, fault_count> notices_{};
};

}  // namespace proxarm::controller
