// Sets up the local problem at a pose (the linearised contacts that hold the tool), solves it for δ, and judges whether
// the iteration may end with this solution.
#pragma once

#include <span>

#include "models/rigid/rigid_state.hpp"
#include "models/rigid_gaps/touch_search.hpp"

namespace proxarm::models {

class LocalStep {
 public:
  // How many contacts the local problems of a step may look at; each costs some 0.2 µs.
  static constexpr int kWork = 1200;

  LocalStep(RigidState& state, Attempt& attempt) noexcept
      : bodies_(&state.bodies),
        candidates_(&state.candidates),
        touches_(&state.touches),
        attempt_(&attempt),
        local_(&state.local),
        search_(state.bodies, state.candidates, state.sides, attempt, state.touches) {}

  void find(const ToolPose& pose, double within_m = Touches::everywhere_m) noexcept { search_.find(pose, within_m); }

  // Solves the local problem at a pose; δ is the next step of the iteration. `e`: the twist from p̂ to the pose.
  // `rough`: as in ContactProblem::solve(); 0 is exact. `still_m`: the rounding of gaps, m, if the forces of the last
  // solution may be kept; else 0. Returns false if no solution was found.
  bool solve(const ToolPose& pose, const Twist& e, const ToolPose& q_old, double rough, double still_m,
             Twist& delta) noexcept;
  // Moves each force into its Coulomb cone, and corrects δ such that the wrenches balance.
  void balance(const Twist& e, Twist& delta) noexcept;

  // Whether the foot of each contact that presses lies on its feature, to within rounding.
  [[nodiscard]] bool on_features() const noexcept;
  // Whether the wrenches still balance after δ. `e`: the twist from p̂ to the pose.
  [[nodiscard]] bool stays_balanced(const Twist& delta, const Twist& e) const noexcept;
  // Returns an upper bound of the turn of the pressing contacts' normals by δ, rad.
  [[nodiscard]] double normals_turn_by(const Twist& delta) const noexcept;
  // Bars the pressing pairs that fulfil reaches_beyond(). Returns whether there were any.
  bool bar_what_reaches_beyond(const ToolPose& pose) noexcept;
  // Whether far pairs may be left out. False with bends, because the stiffness then depends on all pairs that pressed.
  [[nodiscard]] bool may_leave_out() const noexcept;
  void drop_contacts() noexcept;

 private:
  [[nodiscard]] const Pair& pair_of(const Found& found) const noexcept { return candidates_->pairs[found.pair]; }
  [[nodiscard]] const Found& found_of(std::size_t contact) const noexcept {
    return touches_->found[local_->touch_of[contact]];
  }
  [[nodiscard]] std::span<LinearContact> contacts() noexcept {
    return std::span(local_->contacts).first(local_->count);
  }
  [[nodiscard]] bool presses(std::size_t contact) const noexcept {
    return local_->contacts[contact].state != ContactState::open;
  }
  [[nodiscard]] Twist couple(const ToolPose& pose, const Twist& e) noexcept;
  void linearise(const Found& found, const ToolPose& pose, const ToolPose& q_old, LinearContact& out,
                 Mat3& axes) const noexcept;
  [[nodiscard]] double worst_passed(const Twist& xi, const ToolPose& pose) const noexcept;
  bool join(const ToolPose& pose, const ToolPose& q_old, const Twist& delta, bool first, double still_m) noexcept;
  bool still_holds(const ToolPose& pose, const Twist& e, double still_m, Twist& delta) noexcept;
  bool solve_unbent(const Twist& e, double rough, Twist& e_coupled, Twist& delta) noexcept;
  bool solve_fewer(const ToolPose& pose, const Twist& e, double rough, Twist& delta) noexcept;
  void move_touches(const ToolPose& pose, const Twist& delta) noexcept;
  void keep_forces() noexcept;

  RigidBodies* bodies_;
  Candidates* candidates_;
  Touches* touches_;
  Attempt* attempt_;
  LocalProblem* local_;
  TouchSearch search_;
};

}  // namespace proxarm::models
