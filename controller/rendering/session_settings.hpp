// What a session renders, as far as the command line sets it, apart from the cell and the scene.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace proxarm::controller {

enum class OrientationMode : std::uint8_t {
  held,  // the tool keeps the orientation of the start, as with an inertia beyond all bounds
  free,  // the tool turns under the hand's torque with an inertia, a damping and a spring of its own
};

enum class Scheme : std::uint8_t {
  admittance,  // (26): force in, positions out
  impedance,   // (23): position in, torques out; for a light device that a hand can drive back
};

enum class Passivity : std::uint8_t {
  off,
  observe,    // energies are computed and oscillations detected (passivity.hpp)
  automatic,  // besides, damping is added against oscillations that last
  on,         // damping is added against any oscillation at once
};

// The inertia beyond the tool's own where none is asked for.
inline constexpr double default_inertia_kg_m2 = 0.05;

struct SessionSettings {
  Scheme scheme = Scheme::admittance;
  double coupling_stiffness_N_per_m = 750.0;  // impedance type: K and B of the virtual coupling
  double coupling_damping_Ns_per_m = 8.0;
  double period_s = 1e-3;           // T, the timestep of the cycle
  double receive_window = 0.45;     // share of T in which feedback and samples are received
  double mass_kg = 4.0;             // what the hand feels, tool behind the sensor included
  double damping_Ns_per_m = 0.0;    // B, virtual damping against the world at rest
  double spring_N_per_m = 0.0;      // K_v, to the start position
  int order = 1;                    // 1: (26); 2: with weighted forces (force_weights.hpp)
  bool looks_ahead = false;         // the arm is sent to a predicted position of the proxy (lookahead.hpp)
  double horizon_s = 0.0;           // H, the lookahead's horizon
  double gear_damping_per_s = 0.0;  // κ, of gears that are damped by their torque (gear_damping.hpp); 0: none is
  std::uint8_t damped_gears = 0;    // a bit for each joint
  OrientationMode orientation = OrientationMode::held;
  Passivity passivity = Passivity::off;
  // For the passivity observer: the age of the sensor's readings on arrival, and how often the joint that reports its
  // position most seldom does; 0: in each cycle.
  double force_age_s = 0.0, report_rate_Hz = 0.0;
  // What the hand feels of the tool's rotation, tool behind the sensor included; 0: `default_inertia_kg_m2` more.
  double rotational_inertia_kg_m2 = 0.0;
  double rotational_damping_Nms_per_rad = 0.5;
  double rotational_spring_Nm_per_rad = 0.0;  // to the orientation of the start

  double tare_s = 0.2;         // how long readings at rest are averaged before rendering
  double tare_spread_N = 5.0;  // a reading that differs from the mean by this much means that a hand is on the handle
  // What the sensor reads without a load, in S: remembered, or the simulated one's own. While it is tared, the mean of
  // what it reads beyond the tool's weight may differ from that by zero_drift_N. Infinite: it isn't known, and whatever
  // is read counts as zero.
  std::array<double, 3> zero_S_N{};
  double zero_drift_N = std::numeric_limits<double>::infinity();
  bool only_tares = false;   // the session ends once the sensor is tared: nothing moves
  bool always_held = false;  // a hand or a load always acts on the handle: no force is taken for a bias
  double enable_timeout_s = 5.0;
  double enabling_timeout_s = 60.0;      // for the enabling input to be released and pressed
  double wait_after_fault_s = 0.0;       // how long a stop by a fault waits for a reset before the session ends
  bool without_enabling_input = false;   // the cell's enabling input isn't used
  std::uint32_t max_missed_samples = 3;  // cycles in a row without a complete sensor sample
  // How many samples in a row may have exactly the reading of the one before, in all six gauges; 0: any number. If the
  // noise of each gauge has a standard deviation of half a count, a sample repeats the last one with probability 0.49⁶
  // = 0.013, and 20 in a row have a probability of 0.013²⁰ = 3e-38. With 0.2 counts this becomes 5e-14, once in 600
  // years at 1 kHz. A quieter sensor needs a larger number.
  std::uint32_t max_repeated_samples = 20;
  std::uint32_t max_missed_feedback = 3;  // cycles in a row without a drive's TPDO
  std::uint32_t max_overruns = 5;         // late cycles in a row
};

}  // namespace proxarm::controller
