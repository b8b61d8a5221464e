// What may be changed while the arm is led. Each change was checked before, and goes from any thread into the cycle.
#pragma once

#include <array>
#include <cstdint>

#include "models/base/scheduled.hpp"

namespace proxarm::controller {

enum class Parameter : std::uint8_t { none, mass, damping, spring, friction, position, lookahead };

struct Change {
  Parameter parameter = Parameter::none;
  double value = 0.0;        // of the proxy: kg (felt mass less the tool's), Ns/m, N/m; of an object: μ; horizon in s
  std::int32_t object = -1;  // whose, by its index in the scene
  std::array<double, 3> position_m{};  // of an object that is driven: by how much it is away from where it is described
  double period_s = 0.0;               // T that it was checked for; it is left out at another one. 0: good for any
  double horizon_s = -1.0;             // of the lookahead from then on; negative: as it is
};

using ScheduledChange = Scheduled<Change>;  // by the time of rendering

// Another timestep, checked for this cell, and what is counted in cycles of it (SessionSettings).
struct Timestep {
  double period_s = 0.0;  // 0: none
  std::uint32_t max_missed_samples = 0, max_repeated_samples = 0;
  double horizon_s = -1.0;  // of the lookahead from then on; negative: as it is
};

using ScheduledTimestep = Scheduled<Timestep>;  // by the time of rendering

}  // namespace proxarm::controller
