// Work and precision: error against run time of (26), of order 2, and of the methods in use today.
//
// All methods get what a controller gets: the force h(t_k) at the samples and nothing between or ahead of them. All are
// compared at the right time labels: q(k) made of h(t_k) stands for t_{k+1}; the velocity of (26) for the middle of its
// step. The others:
//   penalty_euler      semi-implicit Euler, wall = spring and damper that never pulls, friction = damper up to μ f_n
//   penalty_rk4        the same with classical Runge-Kutta, h held over the step
//   penalty_implicit   the same with implicit Euler (Newton's method)
//   ros                v += T M⁻¹(F − D v − K x), x += T v: the update rule of the common ROS admittance controller,
//                      with D = K = 0 and a spring as wall
// Each is run at many stiffnesses, damping ratios and slopes of the friction law. They take distance and normal from
// the same objects (models/obstacles/obstacle.hpp) that 𝒢 is made of.
//
// Error: rms of the position error over 60 instants of the motion (over all steps where there are fewer); a run's error
// counts as the largest of those with its own and up to twofold finer timesteps, so that an error that happens to cross
// zero isn't taken for precision. Run time: steps times the time of a step, best of fifteen.
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
