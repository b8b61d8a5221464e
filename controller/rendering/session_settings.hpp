// Settings of a session from the command line, apart from cell and scene.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace proxarm::controller {

enum class OrientationMode : std::uint8_t {
  held,  // the tool keeps its orientation at the start, as with infinite inertia
  free,  // the tool turns under the hand's torque, with its own inertia, damping and spring
};

enum class Scheme : std::uint8_t {
  admittance,  // (26): force in, positions out
  impedance,   // (23): position in, torques out; for a light device that a hand can drive back
};

enum class Passivity : std::uint8_t {
  off,
  observe,    // computes energies and detects oscillations (passivity.hpp)
  automatic,  // also adds damping against oscillations that last
  on,         // adds damping against any oscillation at once
};

// Default inertia, in addition to the tool's own.
inline constexpr double default_inertia_kg_m2 = 0.05;

struct SessionSettings {
  Scheme scheme = Scheme::admittance;
  double coupling_stiffness_N_per_m = 750.0;  // impedance type: K and B of the virtual coupling
  double coupling_damping_Ns_per_m = 8.0;
  double period_s = 1e-3;           // T, the timestep of the cycle
  double receive_window = 0.45;     // share of T in which feedback and samples are received
  double mass_kg = 4.0;             // felt by the hand, tool behind the sensor included
  double damping_Ns_per_m = 0.0;    // B, virtual damping against the world at rest
  double spring_N_per_m = 0.0;      // K_v, to the start position
  int order = 1;                    // 1: (26); 2: with weighted forces (force_weights.hpp)
  bool looks_ahead = false;         // the arm is sent to a predicted position of the proxy (lookahead.hpp)
  double horizon_s = 0.0;           // H, the lookahead's horizon
  double gear_damping_per_s = 0.0;  // κ of gears damped by their torque (gear_damping.hpp); 0: off
  std::uint8_t damped_gears = 0;    // bits of joints
  OrientationMode orientation = OrientationMode::held;
  Passivity passivity = Passivity::off;
  // For the passivity observer: age of the sensor's readings on arrival, and rate of the slowest joint feedback; 0:
  // every cycle.
  double force_age_s = 0.0, report_rate_Hz = 0.0;
  // Felt inertia of rotation, tool behind the sensor included; 0: the tool's plus default_inertia_kg_m2.
  double rotational_inertia_kg_m2 = 0.0;
  double rotational_damping_Nms_per_rad = 0.5;
  double rotational_spring_Nm_per_rad = 0.0;  // to the orientation at the start

  double tare_s = 0.2;         // time over which readings at rest are averaged before rendering
  double tare_spread_N = 5.0;  // a reading this far from the mean shows a hand on the handle
  // The sensor's reading without load, in S: remembered, or the simulated sensor's own. The tare's mean less the tool's
  // weight may differ from it by zero_drift_N. Infinite: no zero is known, and any reading counts as zero.
  std::array<double, 3> zero_S_N{};
  double zero_drift_N = std::numeric_limits<double>::infinity();
  bool only_tares = false;   // ends after the tare; nothing moves
  bool always_held = false;  // a hand or load always acts on the handle: no force counts as bias
  double enable_timeout_s = 5.0;
  double enabling_timeout_s = 60.0;      // for releasing and pressing the enabling input
  double wait_after_fault_s = 0.0;       // after a stop by a fault: time for a reset before the session ends
  bool without_enabling_input = false;   // ignores the cell's enabling input
  std::uint32_t max_missed_samples = 3;  // consecutive cycles without a complete sensor sample
  // Consecutive samples that may exactly repeat the reading before, in all six gauges; 0: any number. If each gauge's
  // noise has a standard deviation of half a count, a sample repeats the last one with probability 0.49⁶ = 0.013, and
  // 20 in a row with 0.013²⁰ = 3e-38. With 0.2 counts this is 5e-14, once in 600 years at 1 kHz. A quieter sensor needs
  // a larger number.
  std::uint32_t max_repeated_samples = 20;
  std::uint32_t max_missed_feedback = 3;  // consecutive cycles without a drive's TPDO
  std::uint32_t max_overruns = 5;         // consecutive late cycles
};

}  // namespace proxarm::controller
