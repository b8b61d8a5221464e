// Defines the changes of parameters while the arm moves. A change is checked first; any thread may then send it to the
// cycle.
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
  tool  // the tool behind the sensor
};

struct Change {
  Parameter parameter = Parameter::none;
  // The new value:
  //   mass                             felt mass less the mass of the tool behind the sensor, kg
  //   damping, spring                  Ns/m, N/m
  //   inertia                          felt inertia, kg m²
  //   turning_damping, turning_spring  Nms/rad, Nm/rad
  //   friction                         μ of the object
  //   lookahead                        horizon, s
  //   tool                             the proxy's mass with the new figures of the tool, kg
  double value = 0.0;
  std::int32_t object = -1;  // index of the object in the scene
  // position: displacement of a driven object from its place in the scene file. tool: centre of mass in S.
  std::array<double, 3> position_m{};
  double period_s = 0.0;    // T for which the change was checked; it is ignored at another T. 0: valid for every T
  double horizon_s = -1.0;  // new horizon of the lookahead; negative: unchanged
  // tool: mass of the tool behind the sensor. mass: the tool's mass that was subtracted from the felt mass; 0: none.
  double tool_mass_kg = 0.0;
};

using ScheduledChange = Scheduled<Change>;  // times count rendering only

// A new timestep, checked for this cell, with the counts of cycles that depend on the timestep (SessionSettings).
struct Timestep {
  double period_s = 0.0;  // 0: no new timestep
  std::uint32_t max_missed_samples = 0, max_repeated_samples = 0;
  double horizon_s = -1.0;  // new horizon of the lookahead; negative: unchanged
};

using ScheduledTimestep = Scheduled<Timestep>;  // times count rendering only

}  // namespace proxarm::controller
