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

// Precondition: called once per fault and cycle.
void Supervisor::note(const FaultReport& report) noexcept {
  Notice& notice = notices_[static_cast<std::size_t>(report.fault)];
  if (notice.last == report.cycle + 1) return;
  if (notice.last < report.cycle || notice.last == 0) ++notice.times;
  ++notice.cycles;
  notice.last = report.cycle + 1;
}

void Supervisor::raise(FaultReport report) noexcept {
  Reaction reaction = reactions_[static_cast<std::size_t>(report.fault)];
  // In this phase the arm can't be held, because the drives aren't enabled.
  if (reaction == Reaction::hold && !live()) reaction = Reaction::stop_1;
  report.reaction = reaction;
  note(report);
  if (reaction == Reaction::slow) slow_end_ = report.cycle + 1;
  if (reaction == Reaction::hold) {
    if (phase_ != Phase::holding) held_for_ = report;
    handle(Event::hold);
  }
  if (reaction < Reaction::stop_1) return;
  if (report_.fault == Fault::none) report_ = report;
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
  // Converts a cycle's number plus one (0: none). It rounds towards the present, so that nothing counts as over too
  // early.
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
  report_ = held_for_ = {};
  slow_end_ = 0;
  return true;
}

}  // namespace proxarm::controller
