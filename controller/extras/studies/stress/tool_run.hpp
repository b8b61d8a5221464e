// Makes one run of the stress study of rigid tools: draws a tool, a world and a wrench from the run's seed, and judges
// the steps.
//
// A run has a mass of 100 g to 100 kg with a matching moment of inertia, a timestep of 0.1 to 5 ms, and forces of 10 mN
// to 1 kN with torques of levers up to 50 mm (steady, noise, jumps, sines, random walks, towards an object). A spring
// and a damper keep the tool near the origin, or, in a hollow object, near the object's wall. A run has 1000 steps. It
// ends earlier if a step would move the tool by more than 50 mm or turn it by more than 0.3 rad, or if the tool is more
// than 2 m away from the origin.
//
// The invariants are those of stress.hpp in six dimensions. `stiffness` repeats one of five steps with a random K'
// whose condition is up to 1e4 (Assumption 1). `work` judges the tool's energy. The energy may rise by the hand's work,
// by terms of second order in a step, and by the turn of a normal over an edge (counted as `edge`).
#pragma once

#include "controller/extras/studies/stress/stress_run.hpp"

namespace proxarm::studies {

// Makes the run of this seed, and returns its counts. `moving`: objects move, and the run ends if they leave the tool
// no room. `report`, if not null, gets a line for each violation.
Tally run_tool_seed(std::uint64_t seed, bool moving, std::string* report);

}  // namespace proxarm::studies
