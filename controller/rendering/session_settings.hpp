// What a session renders, apart from the cell and the scene: what a user may set on the command line.
#pragma once

#include <cstdint>

namespace proxarm::controller {

enum class OrientationMode : std::uint8_t {
  held,  // the tool keeps the orientation of the start
  free,  // the tool turns under the hand's torque with an inertia and a damping of its own
};

enum class Scheme : std::uint8_t {
  admittance,  // (26): force in, positions out
  impedance,   // (23): position in, torques out; for a light device that can be driven back
};

enum class Passivity : std::uint8_t {
  off,
  observe,    // energies and oscillations are found (passivity.hpp)
  automatic,  // and damping is added against oscillations that last,
  on,         // or against any at once
};

struct SessionSettings {
  Scheme scheme = Scheme::admittance;
  double coupling_stiffness_N_per_m = 750.0;  // impedance type: K and B of the virtual coupling
  double coupling_damping_Ns_per_m = 8.0;
  double period_s = 1e-3;         // T, the timestep of the cycle
  double receive_window = 0.45;   // of T, in which feedback and samples are taken; in what is left setpoints leave
  double mass_kg = 4.0;           // what the hand feels, tool behind the sensor included
  double damping_Ns_per_m = 0.0;  // B, virtual damping against the world at rest
  double spring_N_per_m = 0.0;    // K_v, to the start position
  int order = 1;                  // 1: (26); 2: BDF2 (bdf2.hpp)
  bool looks_ahead = false;       // the arm is sent to where the proxy is going to be (lookahead.hpp)
  double horizon_s = 0.0;         // H, so far ahead
  OrientationMode orientation = OrientationMode::held;
  Passivity passivity = Passivity::off;
  double force_age_s = 0.0;  // how old the sensor's readings are when they come, for the passivity
  double rotational_inertia_kg_m2 = 0.05;
  double rotational_damping_Nms_per_rad = 0.5;

  double tare_s = 0.2;         // how long the sensor is averaged at rest before rendering
  double tare_spread_N = 5.0;  // a reading that far from the mean means a hand on the handle
  double enable_timeout_s = 5.0;
  double enabling_timeout_s = 60.0;      // for the enabling input to be let go and pressed
  double wait_after_fault_s = 0.0;       // how long a stop by a fault waits for a reset before the session ends
  bool without_enabling_input = false;   // the cell's is left out
  std::uint32_t max_missed_samples = 3;  // cycles in a row without a complete sensor sample
  // How many samples in a row may have exactly the reading of the one before, in all six gauges; 0: any number. With a
  // noise of half a count (standard deviation) per gauge, a sample repeats the last one with probability
  // 0.49⁶ = 0.013, and 20 in a row have a probability of 0.013²⁰ = 3e-38. With 0.2 counts it is 5e-14, once in 600
  // years at 1 kHz. A quieter sensor needs more.
  std::uint32_t max_repeated_samples = 20;
  std::uint32_t max_missed_feedback = 3;  // cycles in a row without a drive's TPDO
  std::uint32_t max_overruns = 5;         // late cycles in a row
};

}  // namespace proxarm::controller
