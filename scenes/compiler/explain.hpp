// Describes what a scene compiles to, what each step skips and why, and how long a step takes on this machine.
#pragma once

#include <string>

#include "scenes/compiler/compile.hpp"

namespace proxarm::scenes {

struct StepCost {
  double free_ns = 0.0;     // median time of a step without contact; 0 if there is no free place
  double contact_ns = 0.0;  // median time of a step on a surface; 0 if there is no surface
};

// Measures a step with a copy of the world. Takes about 20 ms.
StepCost measure_step(const Scene& scene);

// Returns the description as text for the user. On curved surfaces it has a note on steps of first order (see
// docs/reference/scenes.md).
std::string explain(const Scene& scene);

}  // namespace proxarm::scenes
