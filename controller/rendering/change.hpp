// Parameters that may change while the arm moves. Each change has been checked; it enters the cycle from any thread.
#pragma once

#include <array>
#include <cstdint>

#include "models/base/scheduled.hpp"

namespace proxarm::controller {

enum class Parameter : std::uint8_t {
  none,
  mass,
  damping,
  spring,
  friction,
  position,
  lookahead,
  inertia,
  turning_damping,
  turning_spring,
  tool  // behind the sensor
};

struct Change {
  Parameter parameter = Parameter::none;
  // For the proxy: kg (felt mass less the tool's), Ns/m, N/m; for its rotation: kg m² (felt), Nms/rad, Nm/rad; for an
  // object: μ; for the lookahead: s; for the tool behind the sensor: the proxy's mass with that tool.
  double value = 0.0;
  std::int32_t object = -1;            // index of the object in the scene
  std::array<double, 3> position_m{};  // displacement of a driven object from its place in the scene file; for the tool
                                       // behind the sensor: its centre of mass in S
  double period_s = 0.0;               // T of the check; the change is ignored at another T. 0: valid for any
  double horizon_s = -1.0;             // new horizon of the lookahead; negative: unchanged
  double tool_mass_kg = 0.0;  // of the tool behind the sensor; for a mass: subtracted from the felt one; 0: none
};

using ScheduledChange = Scheduled<Change>;  // times count rendering only

// Another timestep, checked for this cell, with the counts of cycles that depend on it (SessionSettings).
struct Timestep {
  double period_s = 0.0;  // 0: none
  std::uint32_t max_missed_samples = 0, max_repeated_samples = 0;
  double horizon_s = -1.0;  // new horizon of the lookahead; negative: unchanged
};

using ScheduledTimestep = Scheduled<Timestep>;  // times count rendering only

}  // namespace proxarm::controller
