// Describes what a scene with a rigid tool compiles to, and how long a step takes on this machine.
#pragma once

#include <string>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Returns the description as text for the user. Takes about 20 ms. Precondition: the scene has a tool. Throws
// description::SetupError if the scene can't be rendered with a rigid tool.
std::string explain_rigid(const Scene& scene);

}  // namespace proxarm::scenes
