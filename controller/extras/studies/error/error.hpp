// Compares work and precision of (26), of order 2, and of the methods in use today: error against run time.
//
// Every method gets what a controller gets: the force h(t_k) at the samples, and no values between or ahead of the
// samples. Every method is compared at the right times: q(k), which is made from h(t_k), with the exact position at
// t_{k+1}, and the velocity of (26) with the exact velocity in the middle of the step. The other methods:
//   penalty_euler      semi-implicit Euler; a wall is a spring and a damper that never pulls, friction is a damper up
//   to
//                      the force μ f_n
//   penalty_rk4        penalty_euler's forces with classical Runge-Kutta, and h held over the step
//   penalty_implicit   penalty_euler's forces with implicit Euler (Newton's method)
//   ros                v += T M⁻¹(F − D v − K x), x += T v: the update rule of the common ROS admittance controller,
//                      with D = K = 0 and a spring as wall
// Each of these methods runs with many stiffnesses, damping ratios and slopes of the friction law. Both Euler methods
// run with the velocity at the position's time, and with the velocity half a step before that time (leapfrog).
// Distances, normals and the Jacobian are in closed form (penalty_world.hpp).
//
// Error: the rms of the position error over 60 instants of the motion, or over all steps if there are fewer than 60.
// Where within a step an event, such as an impact, happens is chance. So each run is repeated with 50 starts spread
// over a step. The error that counts is the one that nine of ten of these runs keep below, at the run's timestep and at
// all finer ones. Run time: the number of steps times the time of a step. That time is measured alternately with the
// time of a step of (26) on the same motion.
#pragma once

#include "controller/extras/studies/common/study.hpp"

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
