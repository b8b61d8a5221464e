// Runs the error study's methods on a motion: (26), order 2, penalty contact with three integrators, and the common ROS
// rule (error.hpp).
#pragma once

#include <array>
#include <vector>

#include "controller/extras/studies/error/error_cases.hpp"
#include "controller/extras/studies/error/penalty_world.hpp"

namespace proxarm::studies {

enum Method { order_1, order_2, penalty_euler, penalty_rk4, penalty_implicit, ros, method_count };
inline constexpr std::array<const char*, method_count> method_names{
    "1", "2", "penalty_euler", "penalty_rk4", "penalty_implicit", "ros"};

// The number of instants of a motion at which positions are compared.
inline constexpr int instants = 60;

// Returns all tunings with which a method is tried on a case.
std::vector<Tuning> tunings(const ErrorCase& which, Method method, bool quick);

struct Errors {
  double position_m = 0.0, velocity_m_per_s = 0.0, force_N = 0.0, energy_J = 0.0, stop_s = 0.0;
};

// Tenth percentile, median and ninetieth percentile of a number over many trials.
struct Spread {
  double low = 0.0, median = 0.0, high = 0.0;

  static Spread of(std::vector<double> values);
};

// The runs of a method with one timestep and all phases. The phase is the place within a step at which the motion
// starts.
struct MethodRun {
  int steps = 0;
  double period_s = 0.0;
  Errors errors;  // medians over the phases
  double position_low_m = 0.0, position_high_m = 0.0;
  double reference_ns = 0.0;  // time of a step of (26)
  // Time of the method's step divided by the time of a step of (26); both are measured alternately.
  Spread of_reference;
};

// Runs one method with one tuning at all timesteps. Returns one MethodRun per timestep, from the coarsest to the
// finest.
std::vector<MethodRun> run_method(const ErrorCase& which, Method method, const Tuning& tuning, bool quick);

}  // namespace proxarm::studies
