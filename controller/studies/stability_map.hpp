// Maps the smallest stable mass over timestep, hand, delay and drive: predicted from eigenvalues
// (controller/stability/stability.hpp), and measured by running the controller's own proxy against the same linear
// plant.
//
// In free motion, the rate of growth or decay is measured once only the slowest mode is left; bisection finds the mass
// at which it is 0. A point is ill-conditioned if 1 % of the hand's stiffness moves the boundary by 3 % or more (|∂ln
// M/∂ln K_h| ≥ 3).
//
// At every tenth point the hand also pushes the proxy against a wall, where it may settle, bounce without end, or
// diverge. Order 2 steps by (26) at contacts, so the larger of the two stable masses counts there. Eigenvalues don't
// include impacts: the hand's mass m_h answers one with a pulse of size m_h/M, which returns after the loop's delay,
// and with m_h/M near 1 the next impact adds to the rest of it. So simulation finds the multiple of the smallest mass
// from which on bouncing doesn't grow.
#pragma once

#include "controller/stability/stability.hpp"
#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

class StabilityMap final : public Study {
 public:
  // A mass counts as stable at walls from this multiple of the smallest stable mass on.
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

// The measured boundary near `guess_kg`; NaN if the growth doesn't change sign within a factor of four.
double measured_boundary_kg(const controller::HandModel& hand, const controller::LoopModel& loop, double guess_kg);

}  // namespace proxarm::studies
