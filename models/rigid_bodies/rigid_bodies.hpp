// The tool and the objects of a rigid world, and where moving objects are in the present part of a step.
//
// An object that moves is touched in its own frame: there the tool comes from where it was relative to where the object
// was, and slip is the motion of a material point of the tool beyond that of the object. Parts of a step divide both
// motions. An object that cannot reach the tool within a step isn't looked at.
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

// An object that moves.
struct MovingEntry {
  RigidMover mover;
  bool close = true;                                // it may meet the tool in this step
  ToolPose gathered{};                              // the tool when the pairs were gathered, in the object's frame
  View tool{}, from{};                              // the tool now and where the sides were taken, in that frame
  Vec3 slid = Vec3::Zero(), turned = Vec3::Zero();  // motion of the tool relative to the object since q(k−1); m, rad
};

class RigidBodies {
 public:
  explicit RigidBodies(std::shared_ptr<const RigidSetup> setup);

  [[nodiscard]] const RigidSetup& setup() const noexcept { return *setup_; }
  [[nodiscard]] const RigidPart& part(const Pair& pair) const noexcept { return setup_->parts[pair.part]; }
  [[nodiscard]] const RigidEntry& entry(const Pair& pair) const noexcept { return setup_->entries[pair.entry]; }
  [[nodiscard]] EdgeLine own_edge(const Pair& pair) const noexcept;    // of the tool, in T
  [[nodiscard]] EdgeLine other_edge(const Pair& pair) const noexcept;  // of the object, in its frame
  [[nodiscard]] const Vec3& other_point(const Pair& pair) const noexcept;
  // √(μ_tool μ_object) if the part has a friction of its own, else the object's.
  [[nodiscard]] double friction(const Pair& pair) const noexcept;
  void set_friction(std::int32_t object, double friction) noexcept;

  // Largest displacement of a point of the tool, m: from a pose to another one, and by a twist.
  [[nodiscard]] double motion_m(const ToolPose& a, const ToolPose& b) const noexcept;
  [[nodiscard]] double size_m(const Twist& xi) const noexcept;
  // Rounding of a gap at a pose, m.
  [[nodiscard]] double rounding_m(const ToolPose& pose) const noexcept;

  // Whether an object ever moves; and whether it does so in this step.
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
  // Null if the object stands still: its frame is W then.
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
  // The tool in the object's frame.
  [[nodiscard]] View seen_from(std::uint16_t entry, const View& tool) const noexcept;

  void set_time(const StepTime& time) noexcept;
  void drive(std::int32_t object, const Pose& X) noexcept;
  void arrive() noexcept;                   // the step is over
  void go_to_time(double time_s) noexcept;  // scripted objects are where they are then; driven ones are left out
  void take_all_as_close() noexcept;        // every object that moves may meet the tool

  // Moves the objects to where they were at q(k−1), and marks those that may meet the tool in a step from q to p̂.
  // Returns how far the tool and what it may meet come together at most, m. If nothing else than one moving object is
  // near, that object carries the step: parts are then divided, and distances measured, in its frame, where a tool that
  // lies on it hardly moves.
  [[nodiscard]] double begin_step(const ToolPose& p_hat, const ToolPose& q) noexcept;
  [[nodiscard]] bool something_approaches() const noexcept;
  [[nodiscard]] bool has_carrier() const noexcept { return carrier_.has_value(); }
  void drop_carrier() noexcept { carrier_.reset(); }

  // p̂ of a part of the step that ends at this share of it.
  [[nodiscard]] ToolPose goal_at(const ToolPose& p_hat, const ToolPose& q_old, double share) const noexcept;
  // Moves the objects to where they are at this share of the step.
  void move_to(double share) noexcept;
  // The same; returns where the tool at q is then, if the carrier takes it along.
  ToolPose carry_to(const ToolPose& q, double share) noexcept;

  // Measures the tool's motion since q(k−1) relative to the objects that move: slip_m() and slip_since_m() use it.
  void measure_slip(const ToolPose& pose, const ToolPose& q_old) noexcept;
  // Slip of the tool's material point at a lever from the reference point, on an object that moves in this step, m.
  [[nodiscard]] Vec3 slip_m(std::uint16_t entry, const Vec3& lever) const noexcept;
  // Slip of the tool's material point that is at `point` at a pose, on any object, m.
  [[nodiscard]] Vec3 slip_since_m(const ToolPose& q_old, std::uint16_t entry, const Vec3& point,
                                  const ToolPose& pose) const noexcept;

 private:
  [[nodiscard]] double room_m(std::uint16_t entry, const ToolPose& pose) const noexcept;
  [[nodiscard]] std::optional<std::size_t> only_one_near(const ToolPose& q, double near) const noexcept;

  std::shared_ptr<const RigidSetup> setup_;
  std::vector<double> friction_;     // of each entry
  std::vector<MovingEntry> moving_;  // of each entry that moves
  double extent_m_ = 0.0;  // largest Σ|coordinate| of the moving objects that are close: places are rounded with it
  std::optional<std::size_t> carrier_;  // index in moving_
};

}  // namespace proxarm::models
