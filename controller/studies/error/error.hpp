// Compares work and precision: error against run time of (26), of order 2, and of the methods in use today.
//
// All methods get what a controller gets: the force h(t_k) at the samples, and no values between or ahead of them. All
// are compared at the right times: q(k), made from h(t_k), belongs to t_{k+1}, and the velocity of (26) to the middle
// of its step. The other methods:
//   penalty_euler      semi-implicit Euler, wall = spring and damper that never pulls, friction = damper up to μ f_n
//   penalty_rk4        the same with classical Runge-Kutta, h held over the step
//   penalty_implicit   the same with implicit Euler (Newton's method)
//   ros                v += T M⁻¹(F − D v − K x), x += T v: the update rule of the common ROS admittance controller,
//                      with D = K = 0 and a spring as wall
// Each runs with many stiffnesses, damping ratios and slopes of the friction law; both Euler methods with the velocity
// at the position's time and half a step before it (leapfrog). Distances, normals and the Jacobian are in closed form
// (penalty_world.hpp).
//
// Error: rms of the position error over 60 instants of the motion, or over all steps if there are fewer. The place of
// an event within a step is chance, so each run is repeated with 50 starts spread over a step. What counts is the error
// that nine of ten of these keep below, at that timestep and all finer ones.
// Run time: number of steps times the time of a step, measured alternately with a step of (26) on the same motion.
#pragma once

#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

class ErrorStudy final : public Study {
 public:
  std::string name() const override { return "error"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
};

}  // namespace proxarm::studies
