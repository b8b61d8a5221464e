// Results of the linear stability analysis for a session's summary; pose_loop.hpp and passed_poses.hpp compute them.
#pragma once

#include <optional>

namespace proxarm::controller {

// An oscillating mode above 3 Hz (faster than deliberate hand motion), and an upper bound on its decay to a tenth.
// Friction in the drives isn't modelled. It shortens the decay: on the default cell with 2 kg by a factor of 2 to 6.
struct Swing {
  double frequency_Hz = 0.0, tenth_s = 0.0;
};

// Places that the arm passed where the felt mass or inertia is unstable: the first one, and the worst one, which
// requires the most. Lacking mass counts as worse than lacking inertia.
struct UnstablePlaces {
  double first_s = 0.0, worst_s = 0.0;
  double felt_mass_kg = 0.0, felt_inertia_kg_m2 = 0.0;  // at the worst place; inertia 0: the tool doesn't turn
  bool lacks_mass = true;                               // at the worst place; false: it lacks inertia for its mass
  std::optional<double> smallest_stable;                // felt mass or inertia, whichever is lacking; absent: none is
                                                        // stable
};

}  // namespace proxarm::controller
