// What the linear loops say of a session, for its summary; pose_loop.hpp and passed_poses.hpp find it.
#pragma once

#include <optional>

namespace proxarm::controller {

// A mode that swings, faster than hands move by will (3 Hz), and how long it takes at most to fall to a tenth: friction
// in the drives, which isn't modelled, lets it fall sooner (the default cell's, with 2 kg: in a sixth to a half of
// that).
struct Swing {
  double frequency_Hz = 0.0, tenth_s = 0.0;
};

// What is felt isn't stable in some places that the arm came by: the first of them, and of all the one that asks for
// most. A place that lacks mass asks for more than one that lacks inertia.
struct UnstablePlaces {
  double first_s = 0.0, worst_s = 0.0;
  double felt_mass_kg = 0.0, felt_inertia_kg_m2 = 0.0;  // at the worst; inertia 0: the tool isn't turned
  bool lacks_mass = true;                               // there; else the inertia that its mass takes
  std::optional<double> smallest_stable;                // of what it lacks, felt, there; absent: none is stable
};

}  // namespace proxarm::controller
