#include "controller/setpoints/held_weight.hpp"

#include <cmath>

#include "models/arm/tool_space.hpp"

namespace proxarm::controller {

using models::JointVector;

namespace {

constexpr int poses = 1000;
// Number of tried angles in a joint's range, and number of rounds over all joints. The weight's torque is a sine of
// each angle, so steps of a hundredth of a turn miss its maximum by at most 0.2 %.
constexpr int places = 100, turns = 3;

bool inside(const description::CellLimits& limits, const models::Vec3& point_W) {
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (point_W[i] < limits.workspace_min_m[k] || point_W[i] > limits.workspace_max_m[k]) return false;
  }
  return true;
}

}  // namespace

HeldWeight held_weight(const models::Arm& arm, const description::Cell& cell, const JointVector& q) {
  const JointVector gravity_Nm = arm.gravity_torque(q);
  HeldWeight most;
  for (int i = 0; i < arm.axes(); ++i) {
    const double rated_Nm = cell.drives[static_cast<std::size_t>(i)].max_torque_Nm;
    if (!(rated_Nm > 0.0)) continue;
    const HeldWeight one{i, std::abs(gravity_Nm[i]), rated_Nm};
    if (most.axis < 0 || one.share() > most.share()) most = one;
  }
  return most;
}

HeldWeight heaviest_weight(const models::Arm& arm, const description::Cell& cell) {
  JointVector q = arm.start_rad();
  HeldWeight most = held_weight(arm, cell, q);
  const auto try_pose = [&](const JointVector& other) {
    const HeldWeight there = held_weight(arm, cell, other);
    if (!(there.share() > most.share()) || !inside(cell.limits, arm.tool_pose(other).translation())) return;
    most = there;
    q = other;
  };
  if (most.axis < 0) return most;
  for (int k = 0; k < poses; ++k) try_pose(models::spread_pose(arm, k));
  for (int joint = 0; joint < turns * arm.axes(); ++joint) {
    const int i = joint % arm.axes();
    for (int place = 0; place <= places; ++place) {
      JointVector other = q;
      other[i] = arm.lower_rad()[i] + (arm.upper_rad()[i] - arm.lower_rad()[i]) * place / places;
      try_pose(other);
    }
  }
  return most;
}

}  // namespace proxarm::controller
