#include "controller/supervisor.hpp"

#include <array>

namespace proxarm::controller {
namespace {

struct Transition {
  Phase from;
  Event event;
  Phase to;
};

constexpr std::array transitions{
    Transition{Phase::idle, Event::begin, Phase::enabling},
    Transition{Phase::idle, Event::stop, Phase::done},
    Transition{Phase::idle, Event::fault, Phase::disabling},
    Transition{Phase::enabling, Event::enabled, Phase::taring},
    Transition{Phase::enabling, Event::stop, Phase::disabling},
    Transition{Phase::enabling, Event::fault, Phase::disabling},
    Transition{Phase::taring, Event::tared, Phase::rendering},
    Transition{Phase::taring, Event::stop, Phase::disabling},
    Transition{Phase::taring, Event::fault, Phase::disabling},
    Transition{Phase::rendering, Event::stop, Phase::stopping},
    Transition{Phase::rendering, Event::fault, Phase::stopping},
    Transition{Phase::stopping, Event::at_rest, Phase::disabling},
    Transition{Phase::disabling, Event::disabled, Phase::done},
};

}  // namespace

const char* phase_name(Phase phase) noexcept {
  switch (phase) {
    case Phase::idle:
      return "idle";
    case Phase::enabling:
      return "enabling";
    case Phase::taring:
      return "taring";
    case Phase::rendering:
      return "rendering";
    case Phase::stopping:
      return "stopping";
    case Phase::disabling:
      return "disabling";
    case Phase::done:
      return "done";
  }
  return "?";
}

void Supervisor::handle(Event event) noexcept {
  for (const Transition& transition : transitions) {
    if (transition.from == phase_ && transition.event == event) {
      phase_ = transition.to;
      return;
    }
  }
}

void Supervisor::raise(const FaultReport& report) noexcept {
  if (report_.fault == Fault::none) report_ = report;
  handle(Event::fault);
}

}  // namespace proxarm::controller
