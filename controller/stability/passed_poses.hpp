// Judges during a session whether the felt mass and inertia are stable in the poses that the arm passes; before a
// session, only the start pose is judged. Modes change with the pose. Over 0.3 m, the default cell's smallest stable
// mass changes by a third. The smallest stable inertia of a tool that is led and turned at once (pose_loop.hpp) changes
// far more.
//
// A place is judged if the tool is at least 50 mm or 0.1 rad (are_near()) away from all places that were judged before
// with the same proxy. Nothing is judged while mass, inertia or damping change from one cycle to the next. judge()
// never runs in the cycle: it takes some milliseconds for a point, some forty for a tool that turns, and half a second
// if the place is unstable.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "controller/stability/pose_loop.hpp"
#include "controller/stability/stability.hpp"
#include "controller/stability/verdict.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

class PassedPoses {
 public:
  // The proxy as the hand feels it, including the part behind the sensor. Inertia 0: the tool doesn't turn.
  struct Felt {
    double mass_kg = 0.0, damping_Ns_per_m = 0.0;
    double inertia_kg_m2 = 0.0, turning_damping_Nms_per_rad = 0.0;
    bool operator==(const Felt&) const = default;
  };

  struct Asked {
    double time_s = 0.0;
    Felt felt;
    LoopModel loop;
    models::JointVector joints_rad;  // the links' angles
  };

  // How far a judged place was from instability.
  struct Place {
    double time_s = 0.0, felt_mass_kg = 0.0;
    std::optional<double> smallest_stable_mass_kg;  // felt mass; absent: no mass is stable
  };

  // `loop` has no arms. `turned` is for a tool that is led and turned at once, as in pose_loop_at(); `loop` replaces
  // the loop in `turned`. Precondition: arm and cell outlive this object.
  PassedPoses(const models::Arm& arm, const description::Cell& cell, const HandModel& hand, const LoopModel& loop,
              std::optional<PoseLoopModel> turned = {});

  // Changes the loop. Places that were judged before are judged again when the tool passes them.
  void change(const LoopModel& loop);
  // Reports the tool's pose at time_s. Returns a place to judge if the pose is new. `joints_rad` returns the links'
  // angles, and is called only if the pose is new.
  template <class Joints>
  std::optional<Asked> come_to(double time_s, const models::ToolPose& tool_W, const Felt& felt,
                               const Joints& joints_rad) {
    if (!is_new(tool_W, felt)) return {};
    return Asked{time_s, felt, loop_, joints_rad()};
  }
  // Judges a place. Returns the unstable places if they should be reported: no unstable place was reported yet for this
  // mass and inertia, or this place requires half as much again as the reported ones. May run on another thread, one
  // call at a time, while come_to() goes on. The functions below then belong to the thread of judge().
  std::optional<UnstablePlaces> judge(const Asked& asked);

  // From now on, judge() also finds the smallest stable mass of each place. Finding it takes ten times as long as
  // judging. It is the mass for the position alone; turning isn't included.
  void find_smallest() noexcept { finds_smallest_ = true; }
  // The places with their smallest stable mass, in the order in which they were judged.
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return found_; }

  [[nodiscard]] std::size_t judged() const noexcept { return judged_; }
  // The unstable places of the whole session; absent: no place was unstable.
  [[nodiscard]] const std::optional<UnstablePlaces>& unstable() const noexcept { return unstable_; }

 private:
  bool is_new(const models::ToolPose& tool_W, const Felt& felt);
  [[nodiscard]] LoopModel loop_at(const Asked& asked) const;
  [[nodiscard]] std::optional<double> smallest_mass(const LoopModel& loop) const;
  [[nodiscard]] std::optional<UnstablePlaces> unstable_at(const Asked& asked, const LoopModel& loop) const;
  [[nodiscard]] std::optional<double> smallest_inertia(const PoseLoop& both, double mass_kg) const;

  const models::Arm& arm_;
  const description::Cell& cell_;
  HandModel hand_;
  LoopModel loop_;
  std::optional<PoseLoopModel> turned_;
  Felt felt_;
  std::vector<models::ToolPose> places_;  // judged with the present loop and proxy; the last one is near the tool
  // State of judge().
  std::size_t judged_ = 0;
  std::optional<UnstablePlaces> unstable_, told_;  // told_: reported for the last mass and inertia
  Felt told_felt_;
  bool finds_smallest_ = false;
  std::vector<Place> found_;
};

}  // namespace proxarm::controller
