// A step of many parts among objects that move, taken in batches of parts.
//
// Parts are as short as a thin tool or a thin sheet asks for: a step of eight millimetres of a tool of 80 µm has five
// hundred, of some microseconds each. Most of them add nothing. If nothing is near, the tool goes at once as far as
// there is room. If something holds it, p̂ goes ahead by many parts at once while the tool hardly moves: a batch is
// lawful if the tool, seen from all that it may meet, goes no further in it than in a part, however far p̂ goes.
#pragma once

#include "models/rigid/fallback.hpp"
#include "models/rigid/iteration.hpp"
#include "models/rigid/way.hpp"

namespace proxarm::models {

class StepInBatches {
 public:
  StepInBatches(RigidState& state, Attempt& attempt, Iteration& iteration, Fallback& fallback, const Way& way) noexcept
      : state_(&state), attempt_(&attempt), iteration_(&iteration), fallback_(&fallback), way_(way) {}

  // False: some batch led nowhere.
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
  double each_m_ = way_.each_m();
  int k_ = 0, batch_ = 1;  // parts that are done, and parts of the next batch
  ToolPose reached_ = way_.q_old;
};

}  // namespace proxarm::models
