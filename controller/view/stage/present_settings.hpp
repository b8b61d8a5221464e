// What a session is set to in its present cycle, whoever changed it: options, scripts, `proxarm set`, a page, a tool.
//
// Followed by the changes that the cycle took, since its records have less: their damping is B with what was added
// against an oscillation, a hold's mass is none, and a spring stands in none of them.
#pragma once

#include <vector>

#include "controller/rendering/change.hpp"
#include "controller/view/stage/stage.hpp"

namespace proxarm::view {

struct PresentSettings {
  double period_s = 0.0;
  double mass_kg = 0.0;  // felt: with the handle's
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  std::vector<double> friction;          // wanted, of each object of the scene
  std::vector<models::Vec3> position_m;  // wanted: by how much each object that is driven is to be moved
  double handle_mass_kg = 0.0;

  // As the session began.
  explicit PresentSettings(const Stage& stage);

  // Takes what the cycle took of `change` at this timestep. True: something is another value than before.
  bool follow(const controller::Change& change, double period_s_now);
};

}  // namespace proxarm::view
