// Keeps the tool and the objects of a rigid world, and the places of moving objects in the present part of a step.
//
// Contact with a moving object is judged in the object's frame. The tool moves there from its former place relative to
// the object to its new one, and slip is the motion of a material point of the tool relative to the object. If a step
// is divided into parts, the motions of tool and object are both divided. Objects that can't reach the tool within a
// step are skipped.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "models/rigid_bodies/pair.hpp"
#include "models/rigid_bodies/rigid_setup.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_features/rigid_mover.hpp"

namespace proxarm::models {

// The state of an object that moves.
struct MovingEntry {
  RigidMover mover;
  bool close = true;    // the object may meet the tool in this step
  ToolPose gathered{};  // pose of the tool when the pairs were gathered, in the object's frame
  // Present pose of the tool, and pose of the tool when the sides were taken, both in the object's frame.
  View tool{}, from{};
  // Displacement and rotation vector of the tool relative to the object since q(k−1), in W; m, rad.
  Vec3 slid = Vec3::Zero(), turned = Vec3::Zero();
};

class RigidBodies {
 public:
  explicit RigidBodies(std::shared_ptr<const RigidSetup> setup);

  [[nodiscard]] const RigidSetup& setup() const noexcept { return *setup_; }
  [[nodiscard]] const RigidPart& part(const Pair& pair) const noexcept { return setup_->parts[pair.part]; }
  [[nodiscard]] const RigidEntry& entry(const Pair& pair) const noexcept { return setup_->entries[pair.entry]; }
  [[nodiscard]] EdgeLine own_edge(const Pair& pair) const noexcept;    // the tool's edge, in T
  [[nodiscard]] EdgeLine other_edge(const Pair& pair) const noexcept;  // the object's edge, in the object's frame
  [[nodiscard]] const Vec3& other_point(const Pair& pair) const noexcept;
  // Returns the pair's coefficient of friction: √(μ_tool μ_object) if the tool's part has a coefficient, else μ_object.
  [[nodiscard]] double friction(const Pair& pair) const noexcept;
  void set_friction(std::int32_t object, double friction) noexcept;

  // Return an upper bound of the displacement of the tool's points, m: motion_m() between two poses, size_m() by a
  // twist.
  [[nodiscard]] double motion_m(const ToolPose& a, const ToolPose& b) const noexcept;
  [[nodiscard]] double size_m(const Twist& xi) const noexcept;
  // Returns the rounding error of a gap at a pose, m.
  [[nodiscard]] double rounding_m(const ToolPose& pose) const noexcept;

  // moves(): whether an object can move at all. moves_now(): whether it moves in this step.
  [[nodiscard]] bool moves(std::uint16_t entry) const noexcept { return entry >= setup_->first_moving; }
  [[nodiscard]] bool moves_now(std::uint16_t entry) const noexcept {
    return moves(entry) && !moving(entry).mover.rests();
  }
  [[nodiscard]] std::span<MovingEntry> moving() noexcept { return moving_; }
  [[nodiscard]] std::span<const MovingEntry> moving() const noexcept { return moving_; }
  [[nodiscard]] MovingEntry& moving(std::uint16_t entry) noexcept { return moving_[entry - setup_->first_moving]; }
  [[nodiscard]] const MovingEntry& moving(std::uint16_t entry) const noexcept {
    return moving_[entry - setup_->first_moving];
  }
  // Returns null if the object can't move; its frame is then W.
  [[nodiscard]] const Placement* placement(std::uint16_t entry) const noexcept {
    return moves(entry) ? &moving(entry).mover.at() : nullptr;
  }
  [[nodiscard]] Vec3 direction_in_object(std::uint16_t entry, const Vec3& n_W) const noexcept {
    const Placement* on = placement(entry);
    return on == nullptr ? n_W : Vec3(on->R.transpose() * n_W);
  }
  [[nodiscard]] Vec3 direction_in_W(std::uint16_t entry, const Vec3& n) const noexcept {
    const Placement* on = placement(entry);
    return on == nullptr ? n : Vec3(on->R * n);
  }
  // Returns the tool's pose in the object's frame.
  [[nodiscard]] View seen_from(std::uint16_t entry, const View& tool) const noexcept;

  void set_time(const StepTime& time) noexcept;
  void drive(std::int32_t object, const Pose& X) noexcept;
  void arrive() noexcept;  // ends the step
  // Puts scripted objects to their places at this time; driven objects then count as not close
  void go_to_time(double time_s) noexcept;
  void take_all_as_close() noexcept;  // marks all moving objects as close

  // Moves the objects to their places at q(k−1), and marks those that may meet the tool in a step from q to p̂. Returns
  // an upper bound of the motion of the tool's points relative to these objects, m. If one moving object and nothing
  // else is near, this object becomes the carrier: the step is then divided, and distances are measured, in the
  // carrier's frame. A tool that lies on the carrier hardly moves in that frame.
  [[nodiscard]] double begin_step(const ToolPose& p_hat, const ToolPose& q) noexcept;
  [[nodiscard]] bool something_approaches() const noexcept;
  [[nodiscard]] bool has_carrier() const noexcept { return carrier_.has_value(); }
  void drop_carrier() noexcept { carrier_.reset(); }

  // Returns p̂ for the part of the step that ends at this share of the step.
  [[nodiscard]] ToolPose goal_at(const ToolPose& p_hat, const ToolPose& q_old, double share) const noexcept;
  // Moves the objects to their places at this share of the step.
  void move_to(double share) noexcept;
  // Does the same, and returns the pose that the tool at q has if the carrier takes the tool along; without a carrier
  // q.
  ToolPose carry_to(const ToolPose& q, double share) noexcept;

  // Measures the tool's motion since q(k−1) relative to the moving objects. slip_m() and slip_since_m() use the result.
  void measure_slip(const ToolPose& pose, const ToolPose& q_old) noexcept;
  // Returns the slip of a material point of the tool on an object that moves in this step, m. `lever` leads from the
  // reference point to the material point, in W.
  [[nodiscard]] Vec3 slip_m(std::uint16_t entry, const Vec3& lever) const noexcept;
  // Returns the slip, on any object, of the tool's material point that is at `point` while the tool is at `pose`, m.
  [[nodiscard]] Vec3 slip_since_m(const ToolPose& q_old, std::uint16_t entry, const Vec3& point,
                                  const ToolPose& pose) const noexcept;

 private:
  [[nodiscard]] double room_m(std::uint16_t entry, const ToolPose& pose) const noexcept;
  [[nodiscard]] std::optional<std::size_t> only_one_near(const ToolPose& q, double near) const noexcept;

  std::shared_ptr<const RigidSetup> setup_;
  std::vector<double> friction_;     // coefficient of each entry
  std::vector<MovingEntry> moving_;  // state of each entry that can move
  // The largest Σ|coordinate| of the positions of the close moving objects, m. The rounding of places grows with it.
  double extent_m_ = 0.0;
  std::optional<std::size_t> carrier_;  // index in moving_
};

}  // namespace proxarm::models
