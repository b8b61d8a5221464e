// Runs the stress study of rigid tools once: draws a tool, a world and a wrench from the run's seed.
//
// A mass of 100 g to 100 kg with a matching moment of inertia, timesteps of 0.1 to 5 ms, forces of 10 mN to 1 kN and
// torques with levers of up to 50 mm (steady, noise, jumps, sines, random walks, towards an object). A spring and a
// damper keep the tool near the origin, or in a hollow object near its wall. A run has 1000 steps. It ends earlier if a
// step would move the tool by 50 mm or turn it by 0.3 rad, or if the tool is 2 m away. The invariants are those of
// stress.hpp in six dimensions. `stiffness` repeats one step in five with a random K' of a condition up to 1e4
// (Assumption 1). `work` is the tool's energy: it may rise by the hand's work, by terms of second order in a step, and
// by the turn of a normal over an edge (counted as `edge`).
#pragma once

#include "controller/studies/stress/stress_run.hpp"

namespace proxarm::studies {

// As run_seed(). `moving`: objects move, and a run ends if they leave the tool no room.
Tally run_tool_seed(std::uint64_t seed, bool moving, std::string* report);

}  // namespace proxarm::studies
