// Motions of a rigid tool whose exact solutions are known, for the study of its errors.
//
// All lie in the plane y = 0 of W, with rotations about y; 𝒢 doesn't know that. Units are m, kg, N, s. The tool's
// reference point is its centre of mass.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::studies {

struct ToolState {
  models::ToolPose pose;
  models::Twist velocity = models::Twist::Zero(), acceleration = models::Twist::Zero();
};

struct ToolCase {
  std::string name{}, title{};
  double mass_kg = 4.0, inertia_kg_m2 = 0.01;
  models::Tool tool{};
  std::vector<models::RigidObject> objects{};
  std::function<models::Wrench(double)> hand{};  // at the centre, at a time
  std::function<ToolState(double)> exact{};
};

// Duration of each motion.
inline constexpr double tool_case_s = 0.96;

std::vector<ToolCase> tool_cases();

}  // namespace proxarm::studies
