// Iterates a part of a step: the solution of the local problem at a pose is the next pose, until the pose no longer
// changes.
//
// 1. A fixed point is exact, because linearisation makes no error at δ = 0.
// 2. In each iterate the error shrinks by the ratio of the step's penetration to the radius of curvature, a thousandth
//    or less.
// 3. If surfaces fit closely (a peg in a hole), the clearance takes the place of the radius, and the ratio is far above
//    one. So the gaps' curvature is added to the local problem (bends.hpp), and the iteration is Newton's method.
#pragma once

#include <limits>

#include "models/rigid/local_step.hpp"

namespace proxarm::models {

class Iteration {
 public:
  Iteration(RigidState& state, Attempt& attempt) noexcept
      : state_(&state), attempt_(&attempt), local_step_(state, attempt) {}

  // Iterates from q and writes the result to q. Returns false if no solution was found or if the budget is used up.
  bool settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept;

  void collect_contacts(const ToolPose& pose) noexcept;
  // Drops the contacts of the last solution, because the tool has left them.
  void drop_contacts() noexcept;

 private:
  enum class Next { iterate, solved, unsolved, stop };
  struct Progress {
    double rounding_m = 0.0, rest_m = 0.0;
    int k = 0;
    // Size of the step before, m; infinite if there was no step
    double last_m = std::numeric_limits<double>::infinity();
    double share = 1.0;  // which share of a step is taken
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
