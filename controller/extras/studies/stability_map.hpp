// Maps the smallest stable mass over timestep, hand, delay and drive. The mass is predicted from eigenvalues
// (controller/stability/stability.hpp), and measured by running the controller's own proxy with the linear plant of the
// prediction.
//
// In free motion, the rate of growth or decay is measured when only the slowest mode is left. Bisection finds the mass
// at which the rate is 0, which is the stability boundary. A point is ill-conditioned if changing the hand's stiffness
// by 1 % moves the boundary by 3 % or more (|∂ln M/∂ln K_h| ≥ 3).
//
// At every tenth point the hand also pushes the proxy against a wall, where the proxy may settle, bounce without end,
// or diverge. At contacts order 2 steps by (26), so for order 2 the larger of the smallest stable masses of both orders
// counts at walls.
//
// The eigenvalues don't include impacts. The hand's mass m_h answers an impact with a pulse of size m_h/M, and the
// pulse returns after the loop's delay. With m_h/M near 1 the next impact adds to what is left of the pulse. So
// simulation finds the multiple of the smallest mass from which on bouncing doesn't grow.
#pragma once

#include "controller/extras/studies/common/study.hpp"
#include "controller/stability/stability.hpp"

namespace proxarm::studies {

class StabilityMap final : public Study {
 public:
  // From this multiple of the smallest stable mass on, a mass counts as stable at walls.
  static constexpr double wall_margin = 1.5;

  std::string name() const override { return "stability"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
  bool failed(const nlohmann::json& headline) const override;
};

// Returns the measured boundary near `guess_kg`; NaN if the rate doesn't change its sign within a factor of four of
// `guess_kg`.
double measured_boundary_kg(const controller::HandModel& hand, const controller::LoopModel& loop, double guess_kg);

}  // namespace proxarm::studies
