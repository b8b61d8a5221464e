// Whether the mass felt is stable where a session comes by. A session is refused by the pose in which it starts; the
// arm's modes, and with them the smallest stable mass, change with the pose: by a third over 0.3 m in the default cell.
//
// A place is judged where the tool is 50 mm or more from all that were judged before with the same proxy: the spacing
// of elastic_arms(). Some milliseconds then, else a comparison; never in the cycle. While mass or damping change from
// one cycle to the next, nothing is judged.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "controller/stability/stability.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class PassedPoses {
 public:
  // The first place in which the mass isn't stable, and of all such the one that asks for the largest.
  struct Unstable {
    double first_s = 0.0;
    double worst_s = 0.0;
    double felt_mass_kg = 0.0;                      // that was felt there
    std::optional<double> smallest_stable_mass_kg;  // felt, there; absent: none is stable
  };

  // `loop`: without arms. The arm and the cell must outlive it.
  PassedPoses(const models::Arm& arm, const description::Cell& cell, const HandModel& hand, const LoopModel& loop);

  // From now on the loop is this; what has been judged is judged again when the tool comes by.
  void change(const LoopModel& loop);
  // The tool is there at that time, felt with so much mass and so much damping of the proxy; `joints_rad`, called only
  // where the place is to be judged, gives the links' angles. True: the mass isn't stable there, and it was the first.
  template <class Joints>
  bool pass(double time_s, const models::Vec3& tool_W_m, double felt_mass_kg, double damping_Ns_per_m,
            const Joints& joints_rad) {
    return is_new(tool_W_m, felt_mass_kg, damping_Ns_per_m) && judge(time_s, joints_rad());
  }

  [[nodiscard]] std::size_t judged() const noexcept { return judged_; }
  [[nodiscard]] const std::optional<Unstable>& unstable() const noexcept { return unstable_; }

 private:
  bool is_new(const models::Vec3& tool_W_m, double felt_mass_kg, double damping_Ns_per_m);
  bool judge(double time_s, const models::JointVector& joints_rad);

  const models::Arm& arm_;
  const description::Cell& cell_;
  HandModel hand_;
  LoopModel loop_;
  double felt_mass_kg_ = 0.0;
  std::vector<models::Vec3> places_;  // judged with this loop and mass; the last is the one that the tool is near
  std::size_t judged_ = 0;
  std::optional<Unstable> unstable_;
};

}  // namespace proxarm::controller
