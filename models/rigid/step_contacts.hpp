// Stores the contacts at the end of a step or of an iterate, and judges whether their work is allowed.
#pragma once

#include <array>
#include <span>

#include "models/geometry/pose_algorithm.hpp"
#include "models/rigid/linear_problem.hpp"
#include "models/rigid_gaps/touches.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

class StepContacts {
 public:
  [[nodiscard]] std::span<const PoseContact> all() const noexcept { return {contacts_.data(), count_}; }
  void clear() noexcept { count_ = 0; }

  // Copies the contacts of the local problem at a pose.
  void collect(const RigidBodies& bodies, const Candidates& candidates, const Touches& touches,
               const LocalProblem& local, const ToolPose& pose) noexcept;
  // Whether all() belongs to the pose that the step reached. If not, collect() must be called.
  [[nodiscard]] bool collected() const noexcept { return collected_; }
  void drop_collected() noexcept { collected_ = false; }

  // Whether the contacts' work on the tool since q_old is positive by more than the terms of second order in the step.
  // If so, the solution is on a side of a feature to which the tool didn't come, for instance below and beside a face.
  [[nodiscard]] bool give_energy(RigidBodies& bodies, const ToolPose& pose, const ToolPose& q_old) const noexcept;
  // Judges which contacts slip. If the tool sticks, q is set to exactly q_old.
  void judge_slips(RigidBodies& bodies, const ToolPose& q_old, ToolPose& q) noexcept;

 private:
  // Further data of a contact.
  struct More {
    double curvature_per_m = 0.0;  // sum of the curvatures of the two bodies
    double turns = 1.0;            // the largest turn of the normal, as a multiple of the tool's rotation
    std::uint16_t entry = 0;
  };
  std::array<PoseContact, ContactProblem::most> contacts_;
  std::array<More, ContactProblem::most> more_;
  std::size_t count_ = 0;
  bool collected_ = false;
  bool with_moving_ = false;  // there is a contact with an object that moves in this step
};

}  // namespace proxarm::models
