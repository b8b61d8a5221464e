// The contacts at the end of a step, or of an iterate, and whether their work is what a step may give.
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

  // Takes the contacts of the local problem at a pose.
  void collect(const RigidBodies& bodies, const Candidates& candidates, const Touches& touches,
               const LocalProblem& local, const ToolPose& pose) noexcept;
  // Whether all() belongs to the pose that the step reached; otherwise collect() is due.
  [[nodiscard]] bool collected() const noexcept { return collected_; }
  void drop_collected() noexcept { collected_ = false; }

  // Whether the contacts' work on the tool since q_old is above 0 by more than is of second order in the step: then the
  // solution is on another side of a feature than the tool came to, below and beside a face, say.
  [[nodiscard]] bool give_energy(RigidBodies& bodies, const ToolPose& pose, const ToolPose& q_old) const noexcept;
  // Judges which contacts slip. A tool that sticks keeps its pose: q becomes q_old, bit for bit.
  void judge_slips(RigidBodies& bodies, const ToolPose& q_old, ToolPose& q) noexcept;

 private:
  // What else is known about a contact.
  struct More {
    double curvature_per_m = 0.0;  // of the two bodies
    double turns = 1.0;            // the normal turns by up to this many times the tool's rotation
    std::uint16_t entry = 0;
  };
  std::array<PoseContact, ContactProblem::most> contacts_;
  std::array<More, ContactProblem::most> more_;
  std::size_t count_ = 0;
  bool collected_ = false;
  bool with_moving_ = false;  // a contact is with an object that moves
};

}  // namespace proxarm::models
