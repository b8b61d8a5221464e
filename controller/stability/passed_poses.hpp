// Whether what is felt is stable where a session comes by. A session is refused by the pose in which it starts; the
// arm's modes, and with them the smallest stable mass and inertia, change with the pose: the mass by a third over 0.3 m
// in the default cell, the inertia of a tool that is led and turned at once (pose_loop.hpp) by far more.
//
// A place is judged where the tool is 50 mm or more from all that were judged before with the same proxy, the spacing
// of led_poses(), or turned from them by 0.1 rad or more. Some milliseconds then, of a tool that turns some forty,
// half a second where it isn't stable; else a comparison; never in the cycle. While mass, inertia or damping change
// from one cycle to the next, nothing is judged.
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
  // The proxy as it is felt, what hangs behind the sensor included. Inertia 0: the tool isn't turned.
  struct Felt {
    double mass_kg = 0.0, damping_Ns_per_m = 0.0;
    double inertia_kg_m2 = 0.0, turning_damping_Nms_per_rad = 0.0;
    bool operator==(const Felt&) const = default;
  };

  // A place to be judged.
  struct Asked {
    double time_s = 0.0;
    Felt felt;
    LoopModel loop;
    models::JointVector joints_rad;  // of the links
  };

  // How far from swinging it was there.
  struct Place {
    double time_s = 0.0, felt_mass_kg = 0.0;
    std::optional<double> smallest_stable_mass_kg;  // felt; absent: none is
  };

  // `loop`: without arms. `turned`, as pose_loop_at() takes it: of a tool that is led and turned at once; its loop is
  // `loop`. The arm and the cell must outlive it.
  PassedPoses(const models::Arm& arm, const description::Cell& cell, const HandModel& hand, const LoopModel& loop,
              std::optional<PoseLoopModel> turned = {});

  // From now on the loop is this; what has been judged is judged again when the tool comes by.
  void change(const LoopModel& loop);
  // The tool is there at that time, and felt so; `joints_rad`, called only where the place is to be judged, gives the
  // links' angles.
  template <class Joints>
  std::optional<Asked> come_to(double time_s, const models::ToolPose& tool_W, const Felt& felt,
                               const Joints& joints_rad) {
    if (!is_new(tool_W, felt)) return {};
    return Asked{time_s, felt, loop_, joints_rad()};
  }
  // What should be told: it isn't stable there, which wasn't told yet of this mass and inertia, or it asks for half as
  // much again as was told. Another thread may call this, one at a time, while the tool goes on; what follows is then
  // that thread's as well.
  std::optional<UnstablePlaces> judge(const Asked& asked);

  // From now on the smallest stable mass is looked for in stable places, too: ten times the work of judging one. The
  // mass alone: turning isn't in it.
  void find_smallest() noexcept { finds_smallest_ = true; }
  // Those places, in the order in which they were judged.
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return found_; }

  [[nodiscard]] std::size_t judged() const noexcept { return judged_; }
  // Of all that was felt.
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
  std::vector<models::ToolPose> places_;  // judged with this loop and proxy; the last is the one that the tool is near
  // Of judge().
  std::size_t judged_ = 0;
  std::optional<UnstablePlaces> unstable_, told_;  // told_: of what was felt last
  Felt told_felt_;
  bool finds_smallest_ = false;
  std::vector<Place> found_;
};

}  // namespace proxarm::controller
