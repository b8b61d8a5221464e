#include "controller/cycle/cycle_status.hpp"

namespace proxarm::controller {

void CycleStatus::show(const ShownCycle& cycle) noexcept {
  phase_.store(cycle.phase, std::memory_order_relaxed);
  period_s_.store(cycle.period_s, std::memory_order_relaxed);
  changes_timestep_.store(cycle.changes_timestep, std::memory_order_relaxed);
  pressed_.store(cycle.pressed, std::memory_order_relaxed);
  cause_lasts_.store(cycle.cause_lasts, std::memory_order_relaxed);
  const ToolEvidence::Numbers numbers = cycle.tool.numbers();
  for (std::size_t i = 0; i < numbers.size(); ++i) tool_[i].store(numbers[i], std::memory_order_relaxed);
  if (cycle.timesteps_answered) answered_timesteps_.store(cycle.asked_timesteps, std::memory_order_release);
}

ToolEvidence CycleStatus::tool_evidence() const noexcept {
  ToolEvidence::Numbers numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = tool_[i].load(std::memory_order_relaxed);
  return ToolEvidence::of(numbers);
}

const char* CycleStatus::refusal(Order order) const noexcept {
  const Phase now = phase();
  const bool changing = changes_timestep();
  switch (order) {
    case Order::none:
      return nullptr;
    case Order::hold:
      return now == Phase::rendering || now == Phase::freeing || changing ? nullptr : "the arm isn't moving";
    case Order::reset:
      if (now != Phase::faulted) return "no stop by a fault waits for a reset";
      if (changing) return "the drives haven't all confirmed their timestep: where it lasts, start anew";
      break;
    case Order::release:
    case Order::back_off:
      if (changing) return "the timestep is being changed: again in a moment";
      [[fallthrough]];
    case Order::resume:
      if (now != Phase::holding) return "the arm isn't in a hold";
      if (cause_lasts_.load(std::memory_order_relaxed)) return "what it is held for is still there";
      break;
  }
  return pressed_.load(std::memory_order_relaxed) ? nullptr : "the enabling input isn't pressed";
}

const char* CycleStatus::timestep_refusal() const noexcept {
  if (fixed_timestep_ != nullptr) return fixed_timestep_;
  if (changes_timestep()) return "it is being changed already";
  const Phase now = phase();
  return now == Phase::rendering || now == Phase::holding ? nullptr : "the arm is neither rendering nor in a hold";
}

}  // namespace proxarm::controller
