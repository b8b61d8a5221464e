// One step of 𝒢 for a rigid tool: in as many parts as it takes, in smaller ones or without friction if that leads
// nowhere.
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

  RigidStep(const RigidStep&) = delete;  // its members refer to each other
  RigidStep& operator=(const RigidStep&) = delete;

  // Writes state.q, the contacts and the flags of the step from q_old.
  void take(const Mat6& K, const ToolPose& p_hat, ToolPose q_old) noexcept;

 private:
  // The part of the way to p̂ that the step takes, in parts. `whole`: all of it.
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
