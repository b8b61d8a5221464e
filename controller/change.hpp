// What may be changed while the arm is led: a number that was checked before, from any thread into the cycle.
#pragma once

#include <array>
#include <cstdint>

namespace proxarm::controller {

enum class Parameter : std::uint8_t { none, mass, damping, spring, friction, position };

struct Change {
  Parameter parameter = Parameter::none;
  double value = 0.0;                  // of the proxy: kg (felt mass less the tool's), Ns/m, N/m; of an object: μ
  std::int32_t object = -1;            // whose, by its index in the scene
  std::array<double, 3> position_m{};  // of an object that is driven: by how much it is away from where it is described
  double period_s = 0.0;               // for which it was checked; at another one it is left out. 0: for any
};

// To take effect after so much rendering.
struct ScheduledChange {
  std::int64_t rendered_ns = 0;
  Change change;
};

// Another timestep, checked for this cell, and what is counted in cycles of it (SessionSettings).
struct Timestep {
  double period_s = 0.0;  // 0: none
  std::uint32_t max_missed_samples = 0, max_repeated_samples = 0;
};

struct ScheduledTimestep {
  std::int64_t rendered_ns = 0;
  Timestep timestep;
};

}  // namespace proxarm::controller
