// Makes and solves the local problem at a pose: the linearised contacts that hold the tool, their solution δ, and
// whether a step may end on it.
#pragma once

#include <span>

#include "models/rigid/rigid_state.hpp"
#include "models/rigid_gaps/touch_search.hpp"

namespace proxarm::models {

class LocalStep {
 public:
  // How many contacts may be looked at in the local problems of a step, some 0.2 µs each.
  static constexpr int kWork = 1200;

  LocalStep(RigidState& state, Attempt& attempt) noexcept
      : bodies_(&state.bodies),
        candidates_(&state.candidates),
        touches_(&state.touches),
        attempt_(&attempt),
        local_(&state.local),
        search_(state.bodies, state.candidates, state.sides, attempt, state.touches) {}

  void find(const ToolPose& pose, double within_m = Touches::everywhere_m) noexcept { search_.find(pose, within_m); }

  // Solves the local problem at a pose that is e off p̂: δ is the next step of the iteration. `rough`: as
  // in ContactProblem::solve(), 0 is exact; `still_m`: rounding, if the last solution may hold already, else 0. False:
  // no solution was found.
  bool solve(const ToolPose& pose, const Twist& e, const ToolPose& q_old, double rough, double still_m,
             Twist& delta) noexcept;
  // Corrects δ so that the wrenches balance after each force is put into its cone.
  void balance(const Twist& e, Twist& delta) noexcept;

  // Whether all that presses has its foot on the feature that it presses on, to within rounding.
  [[nodiscard]] bool on_features() const noexcept;
  // Whether the wrench is balanced after δ, at a pose that is e off p̂.
  [[nodiscard]] bool stays_balanced(const Twist& delta, const Twist& e) const noexcept;
  // By how much δ turns the normals of what presses at most, rad.
  [[nodiscard]] double normals_turn_by(const Twist& delta) const noexcept;
  // Bars the pairs that press through a plane that one of their bodies reaches beyond. Whether there were any.
  bool bar_what_reaches_beyond(const ToolPose& pose) noexcept;
  // Whether pairs that are far may be left out. With bends the coupling depends on the pairs that pressed.
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
