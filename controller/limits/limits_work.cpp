#include "controller/limits/limits_work.hpp"

#include <algorithm>

namespace proxarm::controller {

void LimitsWork::step(const Step& step) noexcept {
  state_.total_J += step.work_J;
  state_.push_J = std::max(0.0, state_.push_J + step.work_J);
  const double explained = braking_s_ * step.power_W + step.kinetic_J;
  state_.explained_J = state_.push_J > 0.0 ? std::max(state_.explained_J, explained) : 0.0;
}

}  // namespace proxarm::controller
