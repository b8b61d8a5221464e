// The present settings of a session, whether changed by options, scripts, `proxarm set`, a page or a tool.
//
// They follow from the changes that the cycle took, since its records don't contain them all: a record's damping
// includes the damping added against oscillations, its mass is zero in a hold, and no record has the spring.
#pragma once

#include <vector>

#include "controller/rendering/change.hpp"
#include "controller/view/stage/stage.hpp"

namespace proxarm::view {

struct PresentSettings {
  double period_s = 0.0;
  double mass_kg = 0.0;  // felt mass, the handle's included
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  std::vector<double> friction;          // wanted μ of each object of the scene
  std::vector<models::Vec3> position_m;  // wanted displacement of each driven object
  double handle_mass_kg = 0.0;

  // The settings with which the session began.
  explicit PresentSettings(const Stage& stage);

  // Applies `change` as the cycle did at this timestep. Returns true if a value is now another.
  bool follow(const controller::Change& change, double period_s_now);
};

}  // namespace proxarm::view
