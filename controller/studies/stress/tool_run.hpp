// One run of the stress study of rigid tools: a tool, a world and a wrench in it, all of them drawn by the run's seed.
//
// A mass of 100 g to 100 kg with a matching moment of inertia, timesteps of 0.1 to 5 ms, forces of 10 mN to 1 kN and
// torques at levers of up to 50 mm (steady, noise, jumps, sines, random walks, towards an object), kept near by a
// spring and a damper (in something hollow: near its wall); 1000 steps, or until a step would go by 50 mm or turn by
// 0.3 rad, or the tool is 2 m away. The invariants are those of stress.hpp, in six dimensions: `stiffness` puts one
// step in five again with a random K' of a condition up to 1e4 (Assumption 1); `work` is the tool's energy: it may rise
// by the hand's work, by what is of second order in a step, and by the turn of a normal over an edge (counted as
// `edge`).
#pragma once

#include "controller/studies/stress/stress_run.hpp"

namespace proxarm::studies {

// As run_seed(). `moving`: objects move; a run ends where they leave the tool no room.
Tally run_tool_seed(std::uint64_t seed, bool moving, std::string* report);

}  // namespace proxarm::studies
