// The methods that the error study compares, and their runs on a case: (26), order 2, penalty contact by three
// integrators, and the common ROS rule (error.hpp).
#pragma once

#include <array>
#include <vector>

#include "controller/studies/error/error_cases.hpp"

namespace proxarm::studies {

enum Method { order_1, order_2, penalty_euler, penalty_rk4, penalty_implicit, ros, method_count };
inline constexpr std::array<const char*, method_count> method_names{
    "1", "2", "penalty_euler", "penalty_rk4", "penalty_implicit", "ros"};

// Instants of a motion at which positions are compared.
inline constexpr int instants = 60;

// The parameters of a penalty method.
struct Tuning {
  double stiffness_N_per_m = 0.0, damping_ratio = 0.0, friction_slope = 1.0;

  bool operator==(const Tuning&) const = default;
};

// All that a method is tried with on a case.
std::vector<Tuning> tunings(const ErrorCase& which, Method method, bool quick);

struct Errors {
  double position_m = 0.0, velocity_m_per_s = 0.0, force_N = 0.0, energy_J = 0.0, stop_s = 0.0;
};

struct MethodRun {
  int steps = 0;
  double period_s = 0.0;
  double step_ns = 0.0;  // processor time of a step, best of fifteen
  Errors errors;
};

// Runs of one method with one tuning, from coarse timesteps to fine ones.
std::vector<MethodRun> run_method(const ErrorCase& which, Method method, const Tuning& tuning, bool quick);

}  // namespace proxarm::studies
