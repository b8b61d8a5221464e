// Defines the settings of a session from the command line, apart from cell and scene.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace proxarm::controller {

enum class OrientationMode : std::uint8_t {
  held,  // the tool keeps the orientation of its start, as if its inertia were infinite
  free,  // the tool turns under the hand's torque, with its own inertia, damping and spring
};

enum class Scheme : std::uint8_t {
  admittance,  // (26): positions are computed from the force
  impedance,   // (23): torques are computed from the position, for a light device that a hand can move by itself
};

enum class Passivity : std::uint8_t {
  off,
  observe,    // computes energies and detects oscillations (passivity.hpp)
  automatic,  // also adds damping against oscillations that last
  on,         // adds damping against any oscillation at once
};

// Default inertia, added to the inertia of the tool behind the sensor.
inline constexpr double default_inertia_kg_m2 = 0.05;

struct SessionSettings {
  Scheme scheme = Scheme::admittance;
  double coupling_stiffness_N_per_m = 750.0;  // impedance type: K of the virtual coupling
  double coupling_damping_Ns_per_m = 8.0;     // impedance type: B of the virtual coupling
  double period_s = 1e-3;                     // T, the timestep of the cycle
  double receive_window = 0.45;               // share of T in which feedback and samples are received
  double mass_kg = 4.0;                       // felt mass, tool behind the sensor included
  double damping_Ns_per_m = 0.0;              // B, damping of the proxy's velocity
  double spring_N_per_m = 0.0;                // K_v of a spring to the start position
  int order = 1;                              // 1: (26); 2: (26) with weighted forces (force_weights.hpp)
  bool looks_ahead = false;                   // the arm is sent to a predicted position of the proxy (lookahead.hpp)
  double horizon_s = 0.0;                     // H, the lookahead's horizon
  double gear_damping_per_s = 0.0;            // κ of the gear damping (gear_damping.hpp); 0: off
  std::uint8_t damped_gears = 0;              // bits of the joints whose gears are damped
  OrientationMode orientation = OrientationMode::held;
  Passivity passivity = Passivity::off;
  // For the passivity observer. force_age_s: age of the sensor's readings on arrival. report_rate_Hz: rate of the
  // slowest drive's feedback; 0: every cycle.
  double force_age_s = 0.0, report_rate_Hz = 0.0;
  // Felt inertia of rotation, tool behind the sensor included. 0: the tool's inertia plus default_inertia_kg_m2.
  double rotational_inertia_kg_m2 = 0.0;
  double rotational_damping_Nms_per_rad = 0.5;
  double rotational_spring_Nm_per_rad = 0.0;  // spring to the orientation at the start

  double tare_s = 0.2;         // time over which readings at rest are averaged before rendering
  double tare_spread_N = 5.0;  // a reading that is this far from the mean shows a hand on the handle
  // The sensor's known reading without load, in S: remembered, or the simulated sensor's.
  std::array<double, 3> zero_S_N{};
  // Largest allowed difference between zero_S_N and the tare's mean less the tool's weight. Infinite: no zero is known,
  // and every mean is accepted.
  double zero_drift_N = std::numeric_limits<double>::infinity();
  bool only_tares = false;   // the session ends after the tare; nothing moves
  bool always_held = false;  // a hand or load always acts on the handle, so no force counts as a bias
  double enable_timeout_s = 5.0;
  double enabling_timeout_s = 60.0;      // longest wait for the enabling input to be released and pressed
  double wait_after_fault_s = 0.0;       // time for a reset after a fault has stopped the arm; then the session ends
  bool without_enabling_input = false;   // ignores the cell's enabling input
  std::uint32_t max_missed_samples = 3;  // consecutive cycles without a complete sensor sample
  // Consecutive samples that may exactly repeat the previous sample, in all six gauges; 0: any number. If each gauge's
  // noise has a standard deviation of half a count, a sample repeats the previous one with probability 0.49⁶ = 0.013,
  // and 20 successive samples do so with 0.013²⁰ = 3e-38. With a standard deviation of 0.2 counts, the probability for
  // 20 samples is 5e-14: once in 600 years at 1 kHz. A sensor with less noise needs a larger number.
  std::uint32_t max_repeated_samples = 20;
  std::uint32_t max_missed_feedback = 3;  // consecutive cycles without a drive's TPDO
  std::uint32_t max_overruns = 5;         // consecutive cycles that end late
};

}  // namespace proxarm::controller
