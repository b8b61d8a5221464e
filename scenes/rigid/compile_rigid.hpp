// From a scene and a rigid tool to the 𝒢 of a pose.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "models/geometry/pose_algorithm.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Why a tool can't be rendered in a scene, as a sentence; none if it can. `line` of the scene's file is set where one
// is to blame.
struct Refusal {
  std::string why;
  int line = 0;
};
std::optional<Refusal> why_not(const Scene& scene, const models::Tool& tool);

// Throws description::SetupError where why_not() has a reason, and for a shape without a size. A scene without objects
// gives FreePose. Media, a Coulomb force and a guide are no part of it: they are refused.
std::unique_ptr<models::PoseAlgorithm> compile_rigid(const Scene& scene, const models::Tool& tool);

}  // namespace proxarm::scenes
