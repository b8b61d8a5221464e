// Tells what a scene with a rigid tool compiles to, and what a step costs on this machine.
#pragma once

#include <string>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// As text for a person. Takes some 20 ms. Precondition: the scene has a tool. Throws description::SetupError for what a
// rigid tool can't be rendered in.
std::string explain_rigid(const Scene& scene);

}  // namespace proxarm::scenes
