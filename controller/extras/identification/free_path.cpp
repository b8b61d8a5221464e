#include "controller/extras/identification/free_path.hpp"

#include <algorithm>

namespace proxarm::identification {
namespace {

using models::JointVector;
using models::Vec3;

constexpr int places_of_path = 16;  // number of checked places on a path, at most 20 mm apart

bool allowed(const description::CellLimits& limits, const Vec3& place_W) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (place_W[axis] < limits.workspace_min_m[i] || place_W[axis] > limits.workspace_max_m[i]) return false;
  }
  return std::none_of(limits.keep_out.begin(), limits.keep_out.end(), [&](const description::BoxDescription& box) {
    const Vec3 low(box.min_m.data()), high(box.max_m.data());
    return (place_W.array() >= low.array()).all() && (place_W.array() <= high.array()).all();
  });
}

}  // namespace

bool free_path(const description::Cell& cell, const models::Arm& arm, const JointVector& from, const JointVector& to) {
  for (int n = 0; n <= places_of_path; ++n) {
    const JointVector q = from + (static_cast<double>(n) / places_of_path) * (to - from);
    if (!allowed(cell.limits, arm.tool_pose(arm.link_from_motor(q)).translation())) return false;
  }
  return true;
}

}  // namespace proxarm::identification
