// Tells what a scene compiles to, what is skipped and why, and what a step costs on this machine.
#pragma once

#include <string>

#include "scenes/compiler/compile.hpp"

namespace proxarm::scenes {

struct StepCost {
  double free_ns = 0.0;     // median of a step that touches nothing; 0 if the proxy can't be clear of everything
  double contact_ns = 0.0;  // median of a step on a surface; 0 if there is none
};

// Takes some 20 ms. Moves its own copy of the world.
StepCost measure_step(const Scene& scene);

// All of this as text for a person, with a note on curved surfaces at first order (see docs/scenes.md).
std::string explain(const Scene& scene);

}  // namespace proxarm::scenes
