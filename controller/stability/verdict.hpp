// Results of the linear stability analysis for a session's summary; pose_loop.hpp and passed_poses.hpp compute them.
#pragma once

#include <optional>

namespace proxarm::controller {

// An oscillating mode above 3 Hz (faster than deliberate hand motion). tenth_s is an upper bound of the time in which
// the mode decays to a tenth. Friction in the drives isn't modelled, and shortens the decay: on the default cell with 2
// kg by a factor of 2 to 6.
struct Swing {
  double frequency_Hz = 0.0, tenth_s = 0.0;
};

// The places that the arm passed and where the felt mass or inertia is unstable: the time of the first place, and the
// worst place, which requires the largest mass or inertia. A place that lacks mass counts as worse than a place that
// lacks inertia.
struct UnstablePlaces {
  double first_s = 0.0, worst_s = 0.0;
  // Felt mass and inertia at the worst place. Inertia 0: the tool doesn't turn.
  double felt_mass_kg = 0.0, felt_inertia_kg_m2 = 0.0;
  // Whether the worst place lacks mass; false: it lacks inertia for its mass.
  bool lacks_mass = true;
  // Smallest stable felt mass or inertia at the worst place, whichever is lacking. Absent: no value is stable.
  std::optional<double> smallest_stable;
};

}  // namespace proxarm::controller
