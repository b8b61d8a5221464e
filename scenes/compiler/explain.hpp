// Describes what a scene compiles to, what each step skips and why, and the time of a step on this machine.
#pragma once

#include <string>

#include "scenes/compiler/compile.hpp"

namespace proxarm::scenes {

struct StepCost {
  double free_ns = 0.0;     // median of a step without contact; 0 if there is no free place
  double contact_ns = 0.0;  // median of a step on a surface; 0 without one
};

// Takes some 20 ms, with a copy of the world.
StepCost measure_step(const Scene& scene);

// All of this as text for the user, with a note on curved surfaces at first order (see docs/scenes.md).
std::string explain(const Scene& scene);

}  // namespace proxarm::scenes
