// The present settings of a session, whether options, scripts, `proxarm set`, a page or a tool changed them.
//
// The settings follow from the changes that the cycle took, since the cycle's records don't contain them all: the
// damping in a record includes the damping added against oscillations, the mass in a record is zero in a hold, and no
// record has the spring.
#pragma once

#include <vector>

#include "controller/rendering/change.hpp"
#include "controller/stage/stage.hpp"

namespace proxarm::view {

struct PresentSettings {
  double period_s = 0.0;
  double mass_kg = 0.0;  // felt mass, including the handle's
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  std::vector<double> friction;          // wanted μ of each object of the scene
  std::vector<models::Vec3> position_m;  // wanted displacement of each driven object
  double handle_mass_kg = 0.0;

  // Begins with the settings of the session's beginning, which `stage` has.
  explicit PresentSettings(const Stage& stage);

  // Applies `change` as the cycle did at this timestep. Returns whether a setting now has another value.
  bool follow(const controller::Change& change, double period_s_now);
};

}  // namespace proxarm::view
