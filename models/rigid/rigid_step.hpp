// Takes one step of 𝒢 for a rigid tool, in as many parts as needed. If this fails, it takes smaller parts, and then
// leaves out friction.
#pragma once

#include "models/rigid/step_in_parts.hpp"

namespace proxarm::models {

class RigidStep {
 public:
  explicit RigidStep(RigidState& state) noexcept
      : state_(&state),
        iteration_(state, attempt_),
        fallback_(state, attempt_),
        in_parts_(state, attempt_, iteration_, fallback_) {}

  RigidStep(const RigidStep&) = delete;  // the members refer to each other
  RigidStep& operator=(const RigidStep&) = delete;

  // Takes the step from q_old. Writes the pose, the contacts and the flags to the state.
  void take(const Mat6& K, const ToolPose& p_hat, ToolPose q_old) noexcept;

 private:
  // How the step is taken: its goal and its number of parts. `whole`: the goal is p̂.
  struct Plan {
    ToolPose goal;
    double far_m = 0.0;
    int parts = 1;
    bool whole = true;
  };

  [[nodiscard]] bool passes_freely(const ToolPose& q_old, double far_m) noexcept;
  [[nodiscard]] Plan plan(const ToolPose& p_hat, const ToolPose& q_old, double far_m) const noexcept;
  void allow(const Plan& plan) noexcept;
  bool take_lawfully(const Way& way) noexcept;
  void take_without_friction(const Way& way) noexcept;
  [[nodiscard]] bool may_look_on() const noexcept;

  RigidState* state_;
  Attempt attempt_;
  Iteration iteration_;
  Fallback fallback_;
  StepInParts in_parts_;
};

}  // namespace proxarm::models
