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
};

// To take effect after so many rendered cycles.
struct ScheduledChange {
  std::uint64_t rendered_cycles = 0;
  Change change;
};

}  // namespace proxarm::controller
