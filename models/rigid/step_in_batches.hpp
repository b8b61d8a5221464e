// Takes a step of many parts among moving objects in batches of parts.
//
// 1. A thin tool or a thin sheet requires short parts. For example, a step of eight millimetres with a tool of 80 µm
//    has five hundred parts, of some microseconds each. Most of them change little, so several parts are taken at
//    once.
// 2. If no object is near, the tool moves at once as far as there is room.
// 3. If an object holds the tool, p̂ moves by many parts at once while the tool hardly moves. Such a batch is correct
//    if the tool, relative to all objects that it may meet, moves by no more than one part allows. How far p̂ moves
//    doesn't matter.
#pragma once

#include "models/rigid/fallback.hpp"
#include "models/rigid/iteration.hpp"
#include "models/rigid/way.hpp"

namespace proxarm::models {

class StepInBatches {
 public:
  StepInBatches(RigidState& state, Attempt& attempt, Iteration& iteration, Fallback& fallback, const Way& way) noexcept
      : state_(&state), attempt_(&attempt), iteration_(&iteration), fallback_(&fallback), way_(way) {}

  // Returns false if some batch had no solution, or if the budget was used up.
  bool take() noexcept;
  [[nodiscard]] const ToolPose& reached() const noexcept { return reached_; }

 private:
  enum class Next { on, again, nowhere, end };

  void begin_batch() noexcept;
  bool go_freely() noexcept;
  [[nodiscard]] Next go_held() noexcept;
  void wait_for_objects() noexcept;

  RigidState* state_;
  Attempt* attempt_;
  Iteration* iteration_;
  Fallback* fallback_;
  Way way_;
  int k_ = 0, batch_ = 1;  // number of parts that are done; number of parts of the next batch
  ToolPose reached_ = way_.q_old;
};

}  // namespace proxarm::models
