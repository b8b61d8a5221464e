// The iteration of a part of a step: from a pose on, the local problem's solution is the next pose, until nothing
// moves.
//
// A fixed point is exact, since at δ = 0 nothing is linearised. The iteration converges by the ratio of the step's
// penetration to the radius of curvature, a thousandth or less. Where surfaces conform (a peg in its hole) that radius
// is their clearance, and the ratio far above one: there the gaps' curvature goes into the local problem as well
// (bends.hpp), which makes this Newton's method.
#pragma once

#include <limits>

#include "models/rigid/local_step.hpp"

namespace proxarm::models {

class Iteration {
 public:
  Iteration(RigidState& state, Attempt& attempt) noexcept
      : state_(&state), attempt_(&attempt), local_step_(state, attempt) {}

  // From q on. False: no solution was found, or the budget is used up.
  bool settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept;

  void collect_contacts(const ToolPose& pose) noexcept;
  // The contacts of the last solution are dropped: the tool left them.
  void drop_contacts() noexcept;

 private:
  enum class Next { iterate, solved, unsolved, stop };
  struct Progress {
    double rounding_m = 0.0, rest_m = 0.0;
    int k = 0;
    double last_m = std::numeric_limits<double>::infinity();  // size of the step before; infinite if there was none
    double share = 1.0;                                       // of a step that is taken
    Twist last_delta = Twist::Zero();
    ToolPose resting{};
  };

  [[nodiscard]] Next iterate(const ToolPose& p_hat, const ToolPose& q_old, Progress& at, ToolPose& q) noexcept;
  [[nodiscard]] Next leave(const ToolPose& p_hat, Progress& at, ToolPose& q) noexcept;
  [[nodiscard]] Next go_on(const Twist& e, const Twist& solution, bool solved, bool roughly, Progress& at,
                           ToolPose& q) noexcept;
  [[nodiscard]] double damped(double share, const Twist& delta, const Twist& last) const noexcept;

  RigidState* state_;
  Attempt* attempt_;
  LocalStep local_step_;
};

}  // namespace proxarm::models
