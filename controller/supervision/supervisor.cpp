#include "controller/supervision/supervisor.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

constexpr std::array table{
    Transition{Phase::idle, Event::begin, Phase::enabling},
    Transition{Phase::idle, Event::stop, Phase::done},
    Transition{Phase::idle, Event::fault, Phase::disabling},
    Transition{Phase::idle, Event::fault_off, Phase::disabling},
    Transition{Phase::enabling, Event::enabled, Phase::taring},
    Transition{Phase::enabling, Event::reenabled, Phase::holding},
    Transition{Phase::enabling, Event::stop, Phase::disabling},
    Transition{Phase::enabling, Event::fault, Phase::disabling},
    Transition{Phase::enabling, Event::fault_off, Phase::disabling},
    Transition{Phase::taring, Event::tared, Phase::rendering},
    Transition{Phase::taring, Event::stop, Phase::disabling},
    Transition{Phase::taring, Event::fault, Phase::disabling},
    Transition{Phase::taring, Event::fault_off, Phase::disabling},
    Transition{Phase::rendering, Event::hold, Phase::holding},
    Transition{Phase::rendering, Event::stop, Phase::stopping},
    Transition{Phase::rendering, Event::fault, Phase::stopping},
    Transition{Phase::rendering, Event::fault_off, Phase::disabling},
    Transition{Phase::holding, Event::resume, Phase::rendering},
    Transition{Phase::holding, Event::free, Phase::freeing},
    Transition{Phase::holding, Event::stop, Phase::stopping},
    Transition{Phase::holding, Event::fault, Phase::stopping},
    Transition{Phase::holding, Event::fault_off, Phase::disabling},
    Transition{Phase::freeing, Event::freed, Phase::holding},
    Transition{Phase::freeing, Event::hold, Phase::holding},
    Transition{Phase::freeing, Event::stop, Phase::stopping},
    Transition{Phase::freeing, Event::fault, Phase::stopping},
    Transition{Phase::freeing, Event::fault_off, Phase::disabling},
    Transition{Phase::stopping, Event::at_rest, Phase::disabling},
    Transition{Phase::stopping, Event::fault_off, Phase::disabling},
    Transition{Phase::disabling, Event::fault_off, Phase::disabling},
    Transition{Phase::disabling, Event::disabled, Phase::done},
    Transition{Phase::disabling, Event::wait, Phase::faulted},
    Transition{Phase::faulted, Event::reset, Phase::enabling},
    Transition{Phase::faulted, Event::stop, Phase::done},
};

constexpr std::array phases{"idle",    "enabling", "taring",    "rendering", "holding",
                            "freeing", "stopping", "disabling", "faulted",   "done"};
constexpr std::array events{"begin", "enabled", "reenabled", "tared",   "hold",     "resume", "free", "freed",
                            "stop",  "fault",   "fault_off", "at_rest", "disabled", "wait",   "reset"};
static_assert(phases.size() == phase_count && events.size() == event_count);

// Whether this fault means that a drive moves without a command.
bool is_astray(Fault fault) noexcept {
  return fault == Fault::drive_deviates || fault == Fault::position_implausible || fault == Fault::tool_too_fast ||
         fault == Fault::elbow_too_fast;
}

// Whether this fault makes drives report faults. The drives' reports then don't count as a second fault: the drives
// stop by ramps of their own.
bool makes_drives_faulty(Fault fault) noexcept {
  switch (fault) {
    case Fault::drive_silent:
    case Fault::drive_fault:
    case Fault::drive_disabled:
    case Fault::drive_not_enabled:
    case Fault::modbus_silent:
    case Fault::timestep_unknown:
    case Fault::bus_off:
    case Fault::send_failed:
    case Fault::receive_overflow:
    case Fault::overrun:
    case Fault::second_master:
    case Fault::error_passive:
    case Fault::interface_down:
      return true;
    default:
      return false;
  }
}

}  // namespace

const char* phase_name(Phase phase) noexcept {
  const auto i = static_cast<std::size_t>(phase);
  return i < phases.size() ? phases[i] : "?";
}

const char* event_name(Event event) noexcept {
  const auto i = static_cast<std::size_t>(event);
  return i < events.size() ? events[i] : "?";
}

std::span<const Transition> transitions() noexcept { return table; }

bool Supervisor::handle(Event event) noexcept {
  const auto row = std::find_if(table.begin(), table.end(),
                                [&](const Transition& t) { return t.from == phase_ && t.event == event; });
  if (row == table.end()) return false;
  phase_ = row->to;
  return true;
}

// Counts a fault. Further calls for a fault in one cycle have no effect.
void Supervisor::note(const FaultReport& report) noexcept {
  Notice& notice = notices_[static_cast<std::size_t>(report.fault)];
  if (notice.last == report.cycle + 1) return;
  if (notice.last < report.cycle || notice.last == 0) ++notice.times;
  ++notice.cycles;
  notice.last = report.cycle + 1;
}

// Whether a fault turns the stop in progress into stop category 0. While drives are switched off, a drive that moves
// uncontrolled does. While the arm stops or drives are switched off, a drive that reports a fault does only if it is a
// second fault, whose first fault didn't make drives report faults.
bool Supervisor::escalates(Fault fault) const noexcept {
  if (fault == Fault::drive_fault) {
    const bool second = faulted() || phase_ == Phase::disabling;
    return (phase_ == Phase::stopping || phase_ == Phase::disabling) && second && !makes_drives_faulty(report_.fault);
  }
  return phase_ == Phase::disabling && is_astray(fault);
}

Reaction Supervisor::reaction_now(Fault fault) const noexcept {
  if (escalates(fault)) return Reaction::stop_0;
  const Reaction reaction = reactions_[static_cast<std::size_t>(fault)];
  // The arm can be held only in rendering, holding and freeing. In other phases the reaction is a stop instead.
  return reaction == Reaction::hold && !live() ? Reaction::stop_1 : reaction;
}

void Supervisor::raise(FaultReport report) noexcept {
  const Reaction reaction = reaction_now(report.fault);
  report.reaction = reaction;
  note(report);
  if (reaction == Reaction::slow) slow_end_ = report.cycle + 1;
  if (reaction == Reaction::hold) {
    if (phase_ != Phase::holding) held_for_ = report;
    handle(Event::hold);
  }
  if (reaction < Reaction::stop_1) return;
  if (report_.fault == Fault::none) {
    report_ = report;
  } else if (reaction == Reaction::stop_0 && !cuts_power()) {
    escalation_ = report;
  }
  handle(reaction == Reaction::stop_0 ? Event::fault_off : Event::fault);
}

void Supervisor::hold() noexcept {
  if (handle(Event::hold)) held_for_ = {};
}

void Supervisor::give_up_hold() noexcept {
  if (held_for_.fault == Fault::none) {
    handle(Event::stop);
    return;
  }
  if (report_.fault == Fault::none) report_ = held_for_;
  handle(Event::fault);
}

void Supervisor::rescale(std::uint64_t cycle, double ratio) noexcept {
  // Converts a cycle's number plus one (0: no such cycle). Rounds towards the present, so that nothing ends too early.
  const auto at = [&](std::uint64_t end) {
    if (end == 0 || end > cycle) return end;
    const double age = std::floor(ratio * static_cast<double>(cycle - end));
    return age < static_cast<double>(cycle) ? cycle - static_cast<std::uint64_t>(age) : std::uint64_t{1};
  };
  slow_end_ = at(slow_end_);
  for (Notice& notice : notices_) notice.last = at(notice.last);
}

bool Supervisor::reset() noexcept {
  if (!handle(Event::reset)) return false;
  report_ = escalation_ = held_for_ = {};
  slow_end_ = 0;
  return true;
}

}  // namespace proxarm::controller
