// Shows the state of a running cycle to other threads, and takes these threads' request to stop.
//
// Each value is a separate atomic, which show() writes once per cycle, so two values may come from different cycles.
// show() writes answered_timesteps() last: a thread that reads answered_timesteps() first sees the other values of the
// cycle that wrote it, or of a later cycle.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "controller/motion/tool_change.hpp"
#include "controller/supervision/command.hpp"
#include "controller/supervision/supervisor.hpp"

namespace proxarm::controller {

// The values of one cycle.
struct ShownCycle {
  Phase phase = Phase::idle;
  double period_s = 0.0;              // T, the time from this cycle to the next one
  bool changes_timestep = false;      // a change of T is under way
  bool pressed = true;                // the enabling input is pressed, or the cell has no enabling input
  bool cause_lasts = false;           // the arm may not move, since the cause of the hold lasts
  bool timesteps_answered = true;     // no requested change of the timestep is under way
  std::uint32_t asked_timesteps = 0;  // number of timestep requests taken from the requesting thread
  ToolEvidence tool{};                // evidence for judging new figures of the tool
};

class CycleStatus {
 public:
  // fixed_timestep: the reason why this session keeps its timestep; nullptr: the timestep can change.
  CycleStatus(double period_s, const char* fixed_timestep) noexcept
      : fixed_timestep_(fixed_timestep), period_s_(period_s) {}

  // The cycle calls this function at its end.
  void show(const ShownCycle& cycle) noexcept;

  // ---- any thread ----
  // Asks for a controlled stop at the next cycle.
  void request_stop() noexcept { stop_requested_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool stop_requested() const noexcept { return stop_requested_.load(std::memory_order_relaxed); }
  // Returns the reason why an order would have no effect now; nullptr if the order would have an effect.
  [[nodiscard]] const char* refusal(Order order) const noexcept;
  // Whether this session always keeps its timestep.
  [[nodiscard]] bool keeps_timestep() const noexcept { return fixed_timestep_ != nullptr; }
  // Returns the reason why the timestep can't be changed now; nullptr if it can be changed.
  [[nodiscard]] const char* timestep_refusal() const noexcept;
  [[nodiscard]] Phase phase() const noexcept { return phase_.load(std::memory_order_relaxed); }
  [[nodiscard]] double period_s() const noexcept { return period_s_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool changes_timestep() const noexcept { return changes_timestep_.load(std::memory_order_relaxed); }
  // The evidence for judging new figures of the tool. Its values may come from two successive cycles, whose values
  // hardly differ.
  [[nodiscard]] ToolEvidence tool_evidence() const noexcept;
  // Number of the requesting thread's timestep requests that were answered: the change is over, or was refused.
  [[nodiscard]] std::uint32_t answered_timesteps() const noexcept {
    return answered_timesteps_.load(std::memory_order_acquire);
  }

 private:
  const char* fixed_timestep_;
  std::atomic<Phase> phase_{Phase::idle};
  std::atomic<double> period_s_;
  std::atomic<bool> changes_timestep_{false}, pressed_{true}, cause_lasts_{false}, stop_requested_{false};
  std::atomic<std::uint32_t> answered_timesteps_{0};
  std::array<std::atomic<double>, ToolEvidence::Numbers().size()> tool_{};
};

}  // namespace proxarm::controller
