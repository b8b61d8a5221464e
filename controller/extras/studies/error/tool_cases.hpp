// Defines motions of a rigid tool, with known exact solutions, for the study of a tool's errors (tool_error.hpp).
//
// All motions lie in the plane y = 0 of W, with rotations about y, but 𝒢 computes them in space. The tool's reference
// point is the tool's centre of mass. Units: m, kg, N, s.
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
  std::function<models::Wrench(double)> hand{};  // wrench at the centre of mass, at a time
  std::function<ToolState(double)> exact{};
};

// The duration of each motion.
inline constexpr double tool_case_s = 0.96;

std::vector<ToolCase> tool_cases();

}  // namespace proxarm::studies
