// Compiles a scene and a rigid tool to a 𝒢 of poses.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "models/geometry/pose_algorithm.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// The reason why a tool can't be rendered in a scene, as a sentence. If a line of the scene's file causes it, `line` is
// that line, else 0. why_not() returns nullopt if the tool can be rendered.
struct Refusal {
  std::string why;
  int line = 0;
};
std::optional<Refusal> why_not(const Scene& scene, const models::Tool& tool);

// Compiles the scene. A scene without objects gives FreePose. Throws description::SetupError if why_not() returns a
// reason, or if a shape has no size. Media, a Coulomb force and a guide are refused.
std::unique_ptr<models::PoseAlgorithm> compile_rigid(const Scene& scene, const models::Tool& tool);

}  // namespace proxarm::scenes
